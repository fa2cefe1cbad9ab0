#include <chrono>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <sstream>

#include "tests/io/dicom_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

/// Each refusal must name the file and say what was wrong.
void expect_refusal(const Scratch& scratch, const std::string& name, const std::string& bytes,
                    const std::string& why) {
    const std::string path = scratch.put(name, bytes), message = refusal(path);
    EXPECT_NE(message.find(name), std::string::npos) << name << ": " << message;
    EXPECT_NE(message.find(why), std::string::npos) << name << ": " << message;
}

template <class T>
std::string spoiled(std::size_t at, T value) {
    std::string bytes = nifti() + raw(ramp(60));
    put(bytes, at, value);
    return bytes;
}

TEST(BadFiles, MissingEmptyOrNoFile) {
    Scratch scratch;
    EXPECT_NE(refusal(scratch.path("none.nii")).find("does not exist"), std::string::npos);
    expect_refusal(scratch, "a.nii", "", "empty");
    expect_refusal(scratch, "a.xyz", "some text", "not known");
    std::filesystem::create_directory(scratch.path("x.nii"));
    EXPECT_NE(refusal(scratch.path("x.nii")).find("folder"), std::string::npos);
}

TEST(BadFiles, NiftiFields) {
    Scratch scratch;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    expect_refusal(scratch, "a.nii", nifti().substr(0, 200), "too short");
    expect_refusal(scratch, "a.nii", nifti() + raw(ramp(30)), "expected 120 bytes");
    expect_refusal(scratch, "a.nii", spoiled(40, std::int16_t{9}), "dim[0]");
    expect_refusal(scratch, "a.nii", spoiled(42, std::int16_t{-5}), "dim[1]");
    expect_refusal(scratch, "a.nii", spoiled(44, std::int16_t{0}), "dim[2]");
    expect_refusal(scratch, "a.nii", spoiled(70, std::int16_t{999}), "datatype");
    expect_refusal(scratch, "a.nii", spoiled(72, std::int16_t{8}), "bitpix");
    expect_refusal(scratch, "a.nii", spoiled(108, nan), "vox_offset");
    expect_refusal(scratch, "a.nii", spoiled(108, 1e30f), "vox_offset");
    expect_refusal(scratch, "a.nii", spoiled(108, 100.0f), "vox_offset");
    expect_refusal(scratch, "a.nii", spoiled(280, nan), "srow");
    expect_refusal(scratch, "a.nii", spoiled(280, 0.0f), "srow");
    std::string bytes = spoiled(254, std::int16_t{0});
    put(bytes, 80, 0.0f);
    expect_refusal(scratch, "a.nii", bytes, "pixdim");
    expect_refusal(scratch, "a.hdr", nifti().replace(345, 1, "i"), "a.img' does not exist");
    const std::string packed = zipped(nifti() + raw(ramp(60)));
    expect_refusal(scratch, "a.nii.gz", packed.substr(0, packed.size() / 2), "ends too early");
}

TEST(BadFiles, NiftiThatIsHarmless) {
    Scratch scratch;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::string bytes = spoiled(112, nan);
    EXPECT_TRUE(inspect(scratch.put("a.nii", bytes)).values.identity());
    put(bytes, 112, 0.0f);
    put(bytes, 116, 5.0f);
    EXPECT_TRUE(inspect(scratch.put("a.nii", bytes)).values.identity());
    bytes = spoiled(254, std::int16_t{0});
    put(bytes, 80, -1.0f);
    const Header header = inspect(scratch.put("a.nii", bytes));
    EXPECT_EQ(header.spacing[0], 1);
    EXPECT_EQ(header.warnings.size(), 1u);
}

TEST(BadFiles, TrailingGigabyteIsNotInflated) {
    Scratch scratch;
    const std::string bytes = nifti() + raw(ramp(60)) + std::string(8 << 20, '\0');
    const Loaded got = loaded(scratch.put("a.nii.gz", zipped(bytes)));
    EXPECT_EQ(samples_of<std::int16_t>(got), ramp(60));
    ASSERT_EQ(got.header.warnings.size(), 1u);
    EXPECT_NE(got.header.warnings[0].text().find("follow the samples"), std::string::npos);
}

std::string nrrd(const std::string& fields) {
    return "NRRD0004\n" + fields + "\n\n" + raw(ramp(60));
}

TEST(BadFiles, NrrdFields) {
    Scratch scratch;
    const std::string good =
        "type: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw";
    EXPECT_EQ(refusal(scratch.put("a.nrrd", nrrd(good))), "");
    const auto with = [&](const std::string& from, const std::string& to) {
        return nrrd(replaced(good, from, to));
    };
    expect_refusal(scratch, "a.nrrd", with("short", "quaternion"), "type");
    expect_refusal(scratch, "a.nrrd", with("type: short\n", ""), "type");
    expect_refusal(scratch, "a.nrrd", with("raw", "zstd"), "encoding");
    expect_refusal(scratch, "a.nrrd", with("5 4 3", "5 4"), "sizes");
    expect_refusal(scratch, "a.nrrd", with("5 4 3", "-5 0 3"), "size of x");
    expect_refusal(scratch, "a.nrrd", with("5 4 3", "4294967296 4294967296 4294967296"), "63 bits");
    expect_refusal(scratch, "a.nrrd", with("dimension: 3", "dimension: 1000000000"), "dimension");
    expect_refusal(scratch, "a.nrrd", with("raw", "raw\nbyte skip: 99999999999"), "byte skip");
    expect_refusal(scratch, "a.nrrd",
                   with("raw", "raw\nspace: LPS\nspace directions: (1,0,0) (2,0,0) (0,0,1)"),
                   "one plane");
    expect_refusal(scratch, "a.nrrd",
                   with("raw", "raw\nspace: LPS\nspace directions: (1,0,0) (0,1,0"), "no vector");
    expect_refusal(scratch, "a.nrrd", "NRRD0004\n" + good, "empty line");
    // More numbers than 64 bits count digits and blanks for.
    expect_refusal(scratch, "a.nrrd",
                   "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 4611686018427387904\n"
                   "encoding: ascii\n\n1",
                   "63 bits");
    // Two axes of channels, of which the second has one entry: the first must not be forgotten.
    const std::string twice =
        "NRRD0004\ntype: short\ndimension: 5\nsizes: 4 5 3 1 1\nkinds: "
        "list domain domain domain list\nendian: little\nencoding: raw\n\n";
    EXPECT_EQ(loaded(scratch.put("b.nrrd", twice + raw(ramp(60)))).header.channels, 4);
    expect_refusal(scratch, "a.nrrd", with("raw", "gzip"), "damaged");
}

TEST(BadFiles, DataOutsideTheHeadersFolder) {
    Scratch scratch;
    scratch.put("secret.raw", std::string(120, 'x'));
    const std::string head =
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\ndata "
        "file: ";
    expect_refusal(scratch, "in/a.nhdr", head + "../secret.raw\n", "outside");
    expect_refusal(scratch, "in/b.nhdr", head + scratch.path("secret.raw") + "\n", "outside");
    std::filesystem::create_symlink("../secret.raw", scratch.path("in/link.raw"));
    expect_refusal(scratch, "in/c.nhdr", head + "link.raw\n", "link out");
    expect_refusal(scratch, "in/d.nhdr", head + "absent.raw\n", "does not exist");
    expect_refusal(scratch, "in/e.nhdr", head + "e.nhdr\n", "short data");
    expect_refusal(scratch, "in/f.nhdr", head + "s%s%n.%d 1 3 1\n", "exactly one");
    expect_refusal(scratch, "in/g.nhdr", head + "s.%099999999d 1 3 1\n", "exactly one");
    expect_refusal(scratch, "in/h.json",
                   R"({"data": "../secret.raw", "dims": [5, 4, 3], "type": "int16"})", "outside");
}

TEST(BadFiles, MetaImageFields) {
    Scratch scratch;
    const auto with = [](const std::string& fields,
                         const std::string& last = "ElementDataFile = LOCAL\n") {
        return "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\n" +
               fields + last + raw(ramp(60));
    };
    EXPECT_EQ(refusal(scratch.put("a.mha", with(""))), "");
    expect_refusal(scratch, "a.mha", with("NDims = 1000000\n"), "NDims");
    expect_refusal(scratch, "a.mha", with("ElementSpacing = 0 1 1\n"), "ElementSpacing");
    expect_refusal(scratch, "a.mha", with("ElementType = MET_BOGUS\n"), "ElementType");
    expect_refusal(scratch, "a.mha", with("TransformMatrix = 0 0 0 0 0 0 0 0 0\n"),
                   "TransformMatrix");
    expect_refusal(scratch, "a.mha", with("CompressedData = True\n"), "damaged");
    expect_refusal(scratch, "a.mha", with("", ""), "ElementDataFile");
    expect_refusal(scratch, "a.mha", with("", "ElementDataFile = \n"), "outside");
}

TEST(BadFiles, VtkAndVti) {
    Scratch scratch;
    const std::string head = "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET STRUCTURED_POINTS\n";
    const std::string tail = "SCALARS s short 1\nLOOKUP_TABLE default\n";
    expect_refusal(scratch, "a.vtk",
                   head + "DIMENSIONS 2147483647 2147483647 2147483647\nPOINT_DATA 1\n" + tail,
                   "63 bits");
    expect_refusal(scratch, "a.vtk", head + "DIMENSIONS 5 4 3\nPOINT_DATA 60\n" + tail + "abc",
                   "short data");
    expect_refusal(scratch, "a.vtk", head + "DIMENSIONS 5 4 3\nPOINT_DATA 59\n" + tail,
                   "POINT_DATA");
    expect_refusal(scratch, "a.vti",
                   "<!DOCTYPE VTKFile [<!ENTITY a \"b\">]><VTKFile type=\"ImageData\">", "DOCTYPE");
    expect_refusal(scratch, "a.vti",
                   "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 -5 0 3 0 3\">",
                   "WholeExtent");
    expect_refusal(scratch, "a.vti", "<VTKFile type=\"ImageData", "ends inside");
    const std::string image = "<ImageData WholeExtent=\"0 4 0 3 0 2\">";
    expect_refusal(scratch, "a.vti", "<VTKFile type=\"ImageData\">" + image + image, "repeated");
}

TEST(Dicom, SeriesIsSortedByPositionWithItsSpacing) {
    Scratch scratch;
    for (int i = 0; i < 3; ++i) {
        Slice slice;
        slice.z = 10 - 2.5 * i;
        slice.pixels.assign(20, static_cast<std::int16_t>(-i));
        scratch.put("d/" + std::to_string(i) + ".dcm", dicom(slice));
    }
    const Loaded got = loaded(scratch.path("d"));
    EXPECT_EQ(got.header.extent, (Extent{5, 4, 3}));
    EXPECT_EQ(got.header.spacing, (Vector{3, 2, 2.5}));  // PixelSpacing: between rows first
    EXPECT_EQ(got.header.origin, (Vector{1, 2, 5}));
    EXPECT_EQ(samples_of<std::int16_t>(got)[0], -2);
    EXPECT_EQ(samples_of<std::int16_t>(got)[59], 0);
    EXPECT_TRUE(got.header.warnings.empty());
}

TEST(Dicom, UnusedHighBitsTakeTheSign) {
    Scratch scratch;
    Slice slice;
    slice.stored = 12;
    slice.pixels.assign(20, 0x7fff);  // 12 bits all set: -1, and junk above them
    EXPECT_EQ(samples_of<std::int16_t>(loaded(scratch.put("a.dcm", dicom(slice))))[7], -1);
}

TEST(Dicom, SlopesOfTheirOwnAreApplied) {
    Scratch scratch;
    for (int i = 0; i < 2; ++i) {
        Slice slice;
        slice.z = i;
        slice.slope = i ? "0.5" : "2";
        scratch.put("d/" + std::to_string(i), dicom(slice));
    }
    const Loaded got = loaded(scratch.path("d"));
    EXPECT_EQ(got.header.type, Type::f32);
    EXPECT_TRUE(got.header.values.identity());
    const auto values = samples_of<float>(got);
    EXPECT_EQ(values[3], 42);
    EXPECT_EQ(values[23], 10.5f);
}

TEST(BadFiles, DicomFields) {
    Scratch scratch;
    Slice slice;
    EXPECT_EQ(refusal(scratch.put("a.dcm", dicom(slice))), "");
    expect_refusal(scratch, "a.dcm", "text", "DICM");
    expect_refusal(scratch, "a.dcm", dicom(slice).substr(0, dicom(slice).size() - 9),
                   "(7fe0,0010)");
    slice.rows = 0;
    expect_refusal(scratch, "a.dcm", dicom(slice), "Rows");
    slice = {};
    slice.rows = 5;
    expect_refusal(scratch, "a.dcm", dicom(slice), "short pixel data");
    slice = {};
    slice.spacing = "0\\abc";
    expect_refusal(scratch, "a.dcm", dicom(slice), "(0028,0030)");
    slice.spacing = "0\\1";
    expect_refusal(scratch, "a.dcm", dicom(slice), "PixelSpacing");
    slice = {};
    slice.orientation = "1\\0\\0\\1\\0\\0";
    expect_refusal(scratch, "a.dcm", dicom(slice), "ImageOrientationPatient");
    slice = {};
    slice.syntax = "1.2.3.4";
    expect_refusal(scratch, "a.dcm", dicom(slice), "1.2.3.4");
    slice = {};
    // Nested by their lengths, and without any.
    for (int depth = 0; depth < 200; ++depth) {
        std::string item;
        put(item, 0, std::uint32_t{0xe000fffe});
        put(item, 4, static_cast<std::uint32_t>(slice.extra.size()));
        slice.extra = element(0x40, 0xa730, "SQ", item + slice.extra);
    }
    expect_refusal(scratch, "a.dcm", dicom(slice), "nested");
    slice.extra.clear();
    for (int depth = 0; depth < 200; ++depth) {
        std::string head = element(0x40, 0xa730, "SQ", "");
        put(head, 8, std::uint32_t{0xffffffff});
        put(head, 12, std::uint32_t{0xe000fffe});
        put(head, 16, std::uint32_t{0xffffffff});
        slice.extra += head;
    }
    expect_refusal(scratch, "a.dcm", dicom(slice), "nested");
}

TEST(BadFiles, DicomSeries) {
    Scratch scratch;
    for (int i = 0; i < 4; ++i) {
        Slice slice;
        slice.z = i < 2 ? i : i - 1;
        scratch.put("copies/" + std::to_string(i) + ".dcm", dicom(slice));
        if (i == 2) slice.pixels[7] += 1;
        scratch.put("same/" + std::to_string(i) + ".dcm", dicom(slice));
        slice.z = i < 3 ? i : 5;
        scratch.put("gap/" + std::to_string(i) + ".dcm", dicom(slice));
    }
    EXPECT_NE(refusal(scratch.path("same")).find("'1.dcm' and '2.dcm'"), std::string::npos)
        << refusal(scratch.path("same"));
    const Header copies = inspect(scratch.path("copies"));
    EXPECT_EQ(copies.extent.z, 3);
    EXPECT_EQ(copies.warnings.size(), 1u);
    const Header gap = inspect(scratch.path("gap"));
    EXPECT_EQ(gap.spacing[2], 1);
    EXPECT_EQ(gap.warnings.size(), 1u);
    Slice other;
    other.z = 7;
    std::string file = dicom(other);
    file.replace(file.find("1.2 "), 3, "1.3");
    scratch.put("gap/other.dcm", file);
    try {
        inspect(scratch.path("gap"));
        FAIL() << "two series";
    } catch (const RequestError& error) {
        EXPECT_NE(std::string(error.what()).find("1.3"), std::string::npos) << error.what();
    }
    Selection pick;
    pick.series = "1";
    EXPECT_EQ(inspect(scratch.path("gap"), pick).extent.z, 1);
    EXPECT_EQ(list_series(scratch.path("gap")).size(), 2u);
}

TEST(BadFiles, Pictures) {
    Scratch scratch;
    Header what;
    what.volume = false;
    what.extent = {16, 16, 1};
    const std::vector<std::uint8_t> values(256, 7);
    for (const char* ending : {".png", ".jpg", ".tif"}) {
        const std::string name = std::string("a") + ending;
        write(scratch.path(name), what, values.data());
        const std::string whole = bytes_in(scratch.path(name));
        for (std::size_t bytes : {whole.size() - 20, whole.size() / 2, std::size_t{9}})
            EXPECT_NE(refusal(scratch.put(name, whole.substr(0, bytes))), "") << name << bytes;
    }
    write(scratch.path("b.png"), what, values.data());
    std::string png = bytes_in(scratch.path("b.png"));
    put(png, 16, std::uint32_t{0x00001000});
    put(png, 20, std::uint32_t{0x00001000});
    expect_refusal(scratch, "b.png", png, "do not fit");
    write(scratch.path("b.tif"), what, values.data());
    std::string tiff = bytes_in(scratch.path("b.tif"));
    const std::size_t entries = static_cast<unsigned char>(tiff[8]), next = 10 + 12 * entries;
    std::string loop = tiff;
    put(loop, next, std::uint32_t{8});
    expect_refusal(scratch, "b.tif", loop, "endless");
    put(tiff, 18, std::uint32_t{0});
    expect_refusal(scratch, "b.tif", tiff, "0 x 16");
}

TEST(BadFiles, Json) {
    Scratch scratch;
    scratch.put("a.raw", std::string(100, '\0'));
    const std::string tail = R"("data": "a.raw", "type": "int16")";
    expect_refusal(scratch, "a.json", "{" + tail + R"(, "dims": [5, 4, 3]})", "expected 120 bytes");
    expect_refusal(scratch, "a.json", "{" + tail + R"(, "dims": [5, -1, 1e300]})", "dims");
    expect_refusal(scratch, "a.json",
                   "{" + tail + R"(, "dims": [5, 2, 1], "spacing": [NaN, 1, 1]})", "not JSON");
    expect_refusal(scratch, "a.json", "{" + tail + R"(, "dims": [5, 2, 1], "spacing": [0, 1, 1]})",
                   "spacing");
    expect_refusal(scratch, "a.json", "{" + tail, "not JSON");
    expect_refusal(scratch, "a.json", std::string(100000, '[') + std::string(100000, ']'),
                   "nested");
}

/// Every row of the table of hostile files, as its README says.
TEST(SharedData, HostileFilesGetTheVerdictOfTheirReadme) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const std::string table = bytes_in(data + "/bad/README.md");
    int rows = 0;
    Selection pick;
    pick.memory_limit = 512 << 20;
    std::istringstream lines(table);
    for (std::string line; std::getline(lines, line);) {  // | `name` | what it is | LOAD | ...
        const bool rejects = line.find("| REJECT |") != line.npos;
        if (!line.starts_with("| `") || (!rejects && line.find("| LOAD |") == line.npos)) continue;
        ++rows;
        const std::string name = line.substr(3, line.find('`', 3) - 3);
        const auto start = std::chrono::steady_clock::now();
        const std::string message = refusal(data + "/bad/" + name, pick);
        // A legal gigabyte, beyond the limit: the size must be said.
        const bool loads = !rejects && name != "nii_bomb_honest.nii.gz";
        EXPECT_EQ(message.empty(), loads) << name << ": " << message;
        if (!loads) {
            EXPECT_NE(message.find(name), std::string::npos) << message;
        }
        EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10)) << name;
    }
    EXPECT_EQ(rows, 88);
}

}  // namespace
}  // namespace edgewise::store
