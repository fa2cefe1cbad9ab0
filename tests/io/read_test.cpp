#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

TEST(ReadNifti, SformOfRasBecomesLps) {
    Scratch scratch;
    std::string head = nifti();
    put(head, 280, 2.0f);   // x to the right, 2 mm a sample
    put(head, 292, 10.0f);  // and 10 mm to the right
    put(head, 112, 0.5f);
    put(head, 116, -3.0f);
    const Loaded got = loaded(scratch.put("a.nii", head + raw(ramp(60))));
    EXPECT_EQ(got.header.extent, (Extent{5, 4, 3}));
    EXPECT_EQ(got.header.spacing, (Vector{2, 1, 1}));
    EXPECT_EQ(got.header.origin, (Vector{-10, 0, 0}));
    EXPECT_EQ(got.header.orientation, "RAS");
    EXPECT_EQ(got.header.direction[0], (Vector{-1, 0, 0}));
    EXPECT_EQ(got.header.values, (ValueMap{0.5, -3}));
    EXPECT_EQ(got.header.unit, "mm");
    EXPECT_EQ(samples_of<std::int16_t>(got), ramp(60));
}

TEST(ReadNifti, GzipGivesTheSameAndChecksItsEnd) {
    Scratch scratch;
    const std::string packed = zipped(nifti() + raw(ramp(60)));
    EXPECT_EQ(samples_of<std::int16_t>(loaded(scratch.put("a.nii.gz", packed))), ramp(60));
    std::string wrong = packed;
    wrong[wrong.size() - 6] ^= 1;  // inside the CRC-32
    EXPECT_NE(refusal(scratch.put("b.nii.gz", wrong)).find("incorrect data check"),
              std::string::npos);
}

TEST(ReadNifti, TakesOneTimePointAndWantsToKnowWhich) {
    Scratch scratch;
    std::string head = nifti();
    put(head, 40, std::int16_t{4});
    put(head, 48, std::int16_t{3});
    const auto values = ramp(180);
    const std::string plain = scratch.put("a.nii", head + raw(values));
    const std::string packed = scratch.put("b.nii.gz", zipped(head + raw(values)));
    EXPECT_EQ(inspect(plain).times, 3);
    EXPECT_THROW(loaded(plain), RequestError);
    for (const std::string& path : {plain, packed})
        for (int time = 0; time < 3; ++time) {
            Selection pick;
            pick.time = time;
            const std::vector<std::int16_t> expected(values.begin() + 60 * time,
                                                     values.begin() + 60 * (time + 1));
            EXPECT_EQ(samples_of<std::int16_t>(loaded(path, pick)), expected) << path << time;
        }
    Selection beyond;
    beyond.time = 3;
    EXPECT_THROW(loaded(plain, beyond), RequestError);
}

TEST(ReadNifti, ChannelsOfTheFifthAxisComeTogether) {
    Scratch scratch;
    std::string head = nifti();
    put(head, 40, std::int16_t{5});
    put(head, 50, std::int16_t{2});
    const auto values = ramp(120);
    const std::string path = scratch.put("a.nii", head + raw(values));
    const auto both = samples_of<std::int16_t>(loaded(path));
    Selection second;
    second.channel = 1;
    const auto one = samples_of<std::int16_t>(loaded(path, second));
    ASSERT_EQ(both.size(), 120u);
    ASSERT_EQ(one.size(), 60u);
    for (std::size_t i = 0; i < 60; ++i) {
        EXPECT_EQ(both[2 * i], values[i]);
        EXPECT_EQ(both[2 * i + 1], values[60 + i]);
        EXPECT_EQ(one[i], values[60 + i]);
    }
}

TEST(ReadNifti, DoublesBecomeFloatsWithAWarningWhereThatLoses) {
    Scratch scratch;
    std::string head = nifti();
    put(head, 70, std::int16_t{64});
    put(head, 72, std::int16_t{64});
    std::vector<double> values(60, 0.5);
    EXPECT_TRUE(loaded(scratch.put("a.nii", head + raw(values))).header.warnings.empty());
    values[1] = 0.1;
    values[2] = 1e300;
    values[3] = std::nan("");
    const Loaded got = loaded(scratch.put("b.nii", head + raw(values)));
    EXPECT_EQ(got.header.type, Type::f32);
    ASSERT_EQ(got.header.warnings.size(), 2u);  // one rounded, one beyond f32
    const auto floats = samples_of<float>(got);
    EXPECT_EQ(floats[1], 0.1f);
    EXPECT_EQ(floats[2], std::numeric_limits<float>::infinity());
    EXPECT_TRUE(std::isnan(floats[3]));
}

TEST(ReadNrrd, DetachedBigEndianWithANumberedList) {
    Scratch scratch;
    for (int z = 0; z < 3; ++z) {
        std::string plane;
        for (int i = 0; i < 6; ++i) plane += {static_cast<char>(z), static_cast<char>(i)};
        scratch.put("s.0" + std::to_string(z), plane);
    }
    const std::string path = scratch.put(
        "a.nhdr",
        "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 3 2 3\nspacings: 1 2 nan\nendian: big\n"
        "encoding: raw\ndata file: s.%02d 0 2 1\n");
    const Loaded got = loaded(path);
    const auto values = samples_of<std::uint16_t>(got);
    for (std::size_t i = 0; i < 18; ++i) EXPECT_EQ(values[i], i / 6 * 256 + i % 6);
    EXPECT_EQ(got.header.spacing, (Vector{1, 2, 1}));
    EXPECT_EQ(got.header.warnings.size(), 1u);
}

TEST(ReadNrrd, SpaceDirectionsAndChannelsInFront) {
    Scratch scratch;
    const std::string path = scratch.put(
        "a.nrrd",
        "NRRD0005\ntype: uchar\ndimension: 3\nspace: right-anterior-superior\nsizes: 3 2 2\n"
        "space directions: none (0,2,0) (3,0,0)\nspace origin: (1,2,3)\nkinds: RGB-color domain "
        "domain\n"
        "encoding: text\n\n0 1 2 3 4 5 6 7 8 9 10 11\n");
    const Loaded got = loaded(path);
    EXPECT_FALSE(got.header.volume);
    EXPECT_EQ(got.header.channels, 3);
    EXPECT_EQ(got.header.extent, (Extent{2, 2, 1}));
    EXPECT_EQ(got.header.spacing, (Vector{2, 3, 1}));
    EXPECT_EQ(got.header.origin, (Vector{-1, -2, 3}));
    EXPECT_EQ(got.header.orientation.substr(0, 2), "AR");
    EXPECT_EQ(samples_of<std::uint8_t>(got)[11], 11);
}

TEST(ReadMetaImage, BelievesTheStreamNotItsStatedSize) {
    Scratch scratch;
    const std::string data = raw(ramp(60));
    uLongf size = compressBound(data.size());
    std::string packed(size, '\0');
    compress(reinterpret_cast<Bytef*>(packed.data()), &size,
             reinterpret_cast<const Bytef*>(data.data()), data.size());
    packed.resize(size);
    const std::string head =
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nCompressedData = "
        "True\nCompressedDataSize = 7\n"
        "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 1 2 3\nAnatomicalOrientation = "
        "RAI\nElementSpacing = 1 2 3\n"
        "DimSize = 5 4 3\nElementType = MET_SHORT\nElementDataFile = a.zraw\n";
    scratch.put("a.zraw", packed);
    const Loaded got = loaded(scratch.put("a.mhd", head));
    EXPECT_EQ(samples_of<std::int16_t>(got), ramp(60));
    EXPECT_EQ(got.header.direction[0], (Vector{0, 1, 0}));  // row 0 of the matrix is where x points
    EXPECT_EQ(got.header.orientation, "PRS");
    EXPECT_EQ(got.header.spacing, (Vector{1, 2, 3}));
    EXPECT_EQ(got.header.warnings.size(), 1u);  // the letters say otherwise
}

TEST(ReadVtk, SkipsVectorsInFrontOfTheScalars) {
    Scratch scratch;
    std::string file =
        "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\n"
        "SPACING 1 2 3\nORIGIN 4 5 6\nPOINT_DATA 2\nVECTORS v float\n";
    file += std::string(24, '\n') + "\nSCALARS s short\nLOOKUP_TABLE default\n" +
            std::string("\1\2\3\4", 4);
    const Loaded got = loaded(scratch.put("a.vtk", file));
    EXPECT_EQ(samples_of<std::int16_t>(got), (std::vector<std::int16_t>{0x102, 0x304}));
    EXPECT_EQ(got.header.origin, (Vector{4, 5, 6}));
}

TEST(ReadVti, Base64WithPaddingBetweenItsParts) {
    Scratch scratch;
    const auto file = [](const std::string& array) {
        return "<?xml version=\"1.0\"?><!-- > -->\n<VTKFile type=\"ImageData\" "
               "byte_order=\"LittleEndian\">"
               "<ImageData WholeExtent=\"0 1 0 0 0 0\" Origin=\"0 0 0\" Spacing=\"1 1 1\"><Piece "
               "Extent=\"0 1 0 0 0 0\">"
               "<PointData><DataArray type=\"Int16\" Name=\"s\" " +
               array + "</DataArray></PointData></Piece></ImageData></VTKFile>\n";
    };
    const std::vector<std::int16_t> expected{0x201, 0x403};
    // 4 0 0 0 | 1 2 3 4, encoded apart and together; and as text.
    EXPECT_EQ(samples_of<std::int16_t>(
                  loaded(scratch.put("a.vti", file("format=\"binary\"> BAAAAA==AQIDBA== ")))),
              expected);
    EXPECT_EQ(samples_of<std::int16_t>(
                  loaded(scratch.put("b.vti", file("format=\"binary\">BAAAAAECAwQ=")))),
              expected);
    EXPECT_EQ(
        samples_of<std::int16_t>(loaded(scratch.put("c.vti", file("format=\"ascii\">513 1027")))),
        expected);
    EXPECT_NE(refusal(scratch.put("d.vti", file("format=\"binary\">BAAAAA@=AQIDBA=="))).find("'@'"),
              std::string::npos);
}

TEST(ReadRaw, IsParsedFromTheRight) {
    Scratch scratch;
    const auto values = ramp(60);
    const std::string path = scratch.put("a:b:5x4x3", "junk" + raw(values));
    const Loaded got = loaded("raw:" + path + ":5x4x3:i16:little:4");
    EXPECT_EQ(samples_of<std::int16_t>(got), values);
    EXPECT_TRUE(got.header.volume);
    EXPECT_FALSE(inspect("raw:" + path + ":5x4:i16").volume);
    EXPECT_THROW(inspect("raw:" + path + ":5xx3:i16"), RequestError);
    EXPECT_THROW(inspect("raw:" + path + ":5x4x3:i17"), RequestError);
    EXPECT_THROW(inspect("raw:" + path + ":5x4x3:i16:5"), InputError);  // one byte short
}

TEST(ReadStack, PicturesFollowTheirNumbers) {
    Scratch scratch;
    Header what;
    what.volume = false;
    what.extent = {3, 2, 1};
    for (int i : {2, 10, 1}) {
        const std::vector<std::uint8_t> plane(6, static_cast<std::uint8_t>(i));
        scratch.put("s/x", "");
        write(scratch.path("s/p" + std::to_string(i) + ".png"), what, plane.data());
    }
    std::filesystem::remove(scratch.path("s/x"));
    const Loaded got = loaded(scratch.path("s"));
    EXPECT_EQ(got.header.extent, (Extent{3, 2, 3}));
    EXPECT_TRUE(got.header.volume);
    const auto values = samples_of<std::uint8_t>(got);
    EXPECT_EQ(values[0], 1);
    EXPECT_EQ(values[6], 2);
    EXPECT_EQ(values[12], 10);
}

TEST(Inspect, OrientOverridesTheFile) {
    Scratch scratch;
    const std::string path = scratch.put("a.nii", nifti() + raw(ramp(60)));
    Selection pick;
    pick.orient = "lpi";
    const Header header = inspect(path, pick);
    EXPECT_EQ(header.orientation, "LPI");
    EXPECT_EQ(header.direction[2], (Vector{0, 0, -1}));
    pick.orient = "LRS";
    EXPECT_THROW(inspect(path, pick), RequestError);
}

TEST(Inspect, RefusesMoreThanTheMemoryLimitBeforeAnythingIsAllocated) {
    Scratch scratch;
    Selection pick;
    pick.memory_limit = 1 << 20;  // the reading itself takes all of it
    const std::string message = refusal(scratch.put("a.nii", nifti() + raw(ramp(60))), pick);
    EXPECT_NE(message.find("needs 120 bytes"), std::string::npos) << message;
}

struct Known {
    const char* path;
    Extent extent;
    Vector spacing;
    Type type;
    double low, high, mean;
    const char* orientation;
};

/// Extents, spacings, ranges and means of real files, decoded by others.
TEST(SharedData, EveryFileIsAsItsReadmeSays) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const Known files[] = {
        {"ct_chest_dicom",
         {512, 512, 40},
         {0.78125, 0.78125, 7},
         Type::u16,
         0,
         2948,
         380.114,
         "LPS"},
        {"ct_headsq_nrrd/quarter.nhdr",
         {64, 64, 93},
         {3.2, 3.2, 1.5},
         Type::i16,
         0,
         3926,
         507.687,
         ""},
        {"ct_stent_raw/stent.json", {128, 128, 256}, {1, 1, 1}, Type::i16, 0, 2000, 35.3982, ""},
        {"ct_tooth_nrrd/tooth.nhdr", {103, 94, 161}, {1, 1, 1}, Type::u16, 0, 1300, 526.871, ""},
        {"ct_engine_nifti/engine.nii.gz",
         {256, 256, 128},
         {1, 1, 1},
         Type::u8,
         0,
         255,
         20.6936,
         "RAS"},
        {"mr_angio_nifti/chris_MRA.nii.gz",
         {200, 256, 120},
         {0.52083, 0.52083, 0.65},
         Type::u8,
         0,
         254,
         0.844335,
         "RAS"},
        {"mr_aorta_mha/aorta.mha",
         {157, 393, 34},
         {0.878906, 0.878906, 1.50009},
         Type::f32,
         0,
         2570.2,
         282.725,
         "RAS"},
        {"mr_carotid_vtk/carotid.vtk", {76, 49, 45}, {1, 1, 1}, Type::f32, 0, 580, 99.0491, ""},
        {"mr_brain_nifti/MR.nii.gz",
         {160, 232, 160},
         {1, 0.898437, 0.898437},
         Type::u8,
         0,
         255,
         55.6883,
         "RAS"},
        {"mr_fetal_nrrd/template_T2.nrrd",
         {117, 159, 126},
         {0.859375, 0.859375, 0.859375},
         Type::f32,
         0,
         710.678,
         64.3987,
         "LPS"},
        {"sim_hydrogen_vti/hydrogen.vti", {64, 64, 64}, {1, 1, 1}, Type::f32, 0, 1, 0.0185242, ""},
        {"seg_frog_mhd/frogtissue.mhd",
         {500, 470, 136},
         {1, 1, 1.5},
         Type::u8,
         0,
         29,
         0.384214,
         ""},
        {"mic_neuron_tiff/neuron.tif", {409, 415, 119}, {1, 1, 1}, Type::u8, 0, 255, 0.104822, ""},
        {"img_2d/hdr_room.png",
         {676, 449, 1},
         {1, 1, 1},
         Type::u16,
         0,
         65535,
         (29332 + 27282 + 25970) / 3.0,
         ""},
        {"img_2d/coffee.png",
         {600, 400, 1},
         {1, 1, 1},
         Type::u8,
         0,
         255,
         (158.57 + 85.79 + 51.48) / 3,
         ""},
        {"img_2d/DFM_4209.jpg",
         {3000, 1987, 1},
         {1, 1, 1},
         Type::u8,
         0,
         241,
         (126.24 + 114.82 + 109.62) / 3,
         ""},
    };
    for (const Known& known : files) {
        const Loaded got = loaded(data + "/" + known.path);
        EXPECT_EQ(got.header.extent, known.extent) << known.path;
        EXPECT_EQ(got.header.type, known.type) << known.path;
        EXPECT_EQ(got.header.orientation, known.orientation) << known.path;
        // The README gives five to six digits.
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(got.header.spacing[axis], known.spacing[axis], 1e-5 * known.spacing[axis])
                << known.path;
        double low = INFINITY, high = -INFINITY, sum = 0;
        const auto take = [&](const auto& values) {
            for (const auto value : values) {
                low = std::min(low, static_cast<double>(value));
                high = std::max(high, static_cast<double>(value));
                sum += static_cast<double>(value);
            }
            return sum / static_cast<double>(values.size());
        };
        const double mean = known.type == Type::u8    ? take(samples_of<std::uint8_t>(got))
                            : known.type == Type::i16 ? take(samples_of<std::int16_t>(got))
                            : known.type == Type::u16 ? take(samples_of<std::uint16_t>(got))
                                                      : take(samples_of<float>(got));
        EXPECT_NEAR(low, known.low, 1e-5 * known.high) << known.path;
        EXPECT_NEAR(high, known.high, 1e-5 * known.high) << known.path;
        EXPECT_NEAR(mean, known.mean, 1e-4 * known.mean) << known.path;
    }
}

TEST(SharedData, ExrComesThroughItsModule) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    const Loaded got = loaded(data + "/img_2d/Desk.exr");
    EXPECT_EQ(got.header.extent, (Extent{644, 874, 1}));
    EXPECT_EQ(got.header.alpha, Alpha::premultiplied);
    const auto values = samples_of<float>(got);
    const double expected[] = {6.064, 6.048, 2.850};  // means of red, green, blue
    for (std::size_t channel = 0; channel < 3; ++channel) {
        double sum = 0;
        for (std::size_t i = channel; i < values.size(); i += 4) sum += values[i];
        EXPECT_NEAR(sum / (static_cast<double>(values.size()) / 4), expected[channel], 5e-4);
    }
}

}  // namespace
}  // namespace edgewise::store
