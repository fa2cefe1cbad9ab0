// Files changed at random: no crash, no error of another kind, no hang, no allocation that the file
// does not warrant. The seeds are fixed; EDGEWISE_FUZZ_ROUNDS asks for more than a few seconds'
// worth.

#include <bzlib.h>
#include <chrono>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <random>

#include "io/channel_colours.hpp"
#include "tests/io/dicom_testing.hpp"

#if defined(__SANITIZE_ADDRESS__)
// Of sanitizer/allocator_interface.h, which GCC does not install.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void*,
                                                                           std::size_t),
                                                         void (*on_free)(const volatile void*));
#endif

namespace edgewise::store {
namespace {

using namespace testing;

// Given to the readers: OpenImageIO alone takes 136 MiB.
constexpr std::size_t kLimit = 256 << 20;
// 64 MiB of samples are believed; a library may take as much again in one piece.
constexpr std::size_t kLargest = 128 << 20;

/// The largest allocation since the last call of reset; known under AddressSanitizer only.
class Largest {
 public:
    static void reset() { bytes() = 0; }
    static std::size_t& bytes() {
        static thread_local std::size_t largest = 0;
        return largest;
    }
    static void watch() {
#if defined(__SANITIZE_ADDRESS__)
        static const int installed = __sanitizer_install_malloc_and_free_hooks(
            [](const volatile void*, std::size_t size) { bytes() = std::max(bytes(), size); },
            [](const volatile void*) {});
        ASSERT_NE(installed, 0);
#endif
    }
};

struct Seed {
    std::string name, bytes;
};

std::string nrrd_seed(const std::string& encoding, const std::string& data) {
    return "NRRD0004\ntype: short\ndimension: 4\nsizes: 1 5 4 3\nkinds: list domain domain domain\n"
           "space: LPS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2,3)\n"
           "endian: big\nencoding: " +
           encoding + "\n\n" + data;
}

std::string vtk_seed(const char* form, const std::string& data) {
    return std::string("# vtk DataFile Version 3.0\nx\n") + form +
           "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 4 3\nSPACING 1 1 2\nORIGIN 0 0 0\n"
           "POINT_DATA 60\nSCALARS s short 1\nLOOKUP_TABLE default\n" +
           data;
}

std::string vti_seed(const std::string& root, const std::string& array, const std::string& after) {
    return "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"" + root +
           "><ImageData WholeExtent=\"0 4 0 3 0 2\" Origin=\"0 0 0\" Spacing=\"1 1 1\">"
           "<Piece Extent=\"0 4 0 3 0 2\"><PointData Scalars=\"s\"><DataArray type=\"Int16\" "
           "Name=\"s\" " +
           array + "</DataArray></PointData></Piece></ImageData>" + after + "</VTKFile>";
}

std::string text_of_ramp() {
    std::string text;
    for (std::int16_t value : ramp(60)) text += std::to_string(value) + " ";
    return text;
}

std::string base64(const std::string& bytes) {
    constexpr std::string_view kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits =
                bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

/// The zlib stream of bytes, with its counts in front as VTK writes them: one block.
std::string blocks_of(const std::string& bytes) {
    std::string packed(compressBound(bytes.size()), '\0');
    uLongf size = packed.size();
    compress(reinterpret_cast<Bytef*>(packed.data()), &size,
             reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    packed.resize(size);
    const auto whole = static_cast<std::uint32_t>(bytes.size());
    return raw(std::vector<std::uint32_t>{1, whole, 0, static_cast<std::uint32_t>(size)}) + packed;
}

std::string bzipped(std::string bytes) {
    std::string packed(bytes.size() + 1000, '\0');
    auto size = static_cast<unsigned>(packed.size());
    BZ2_bzBuffToBuffCompress(packed.data(), &size, bytes.data(),
                             static_cast<unsigned>(bytes.size()), 9, 0, 0);
    packed.resize(size);
    return packed;
}

std::string hexadecimal(const std::string& bytes) {
    std::string text;
    for (const char c : bytes) {
        text += "0123456789abcdef"[static_cast<unsigned char>(c) >> 4];
        text += "0123456789abcdef"[static_cast<unsigned char>(c) & 15];
    }
    return text;
}

/// 60 numbers of 64 bits.
std::string wide_ramp() {
    const auto narrow = ramp(60);
    return raw(std::vector<std::int64_t>(narrow.begin(), narrow.end()));
}

std::string vtk_fields(const char* form, const std::string& data, const std::string& wide) {
    return std::string("# vtk DataFile Version 5.1\nx\n") + form +
           "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 4 3\nSPACING 1 1 2\nORIGIN 0 0 0\n"
           "POINT_DATA 60\nFIELD FieldData 2\nlabels 1 60 vtktypeint64\n" +
           wide + "\nMETADATA\nINFORMATION 0\n\nvalues 1 60 short\n" + data +
           "\nCELL_DATA 24\nVECTORS v char\n" +
           (wide[0] ? text_of_ramp() + text_of_ramp() : std::string(72, 'x'));
}

/// A page of 6 x 4 pixels for each strip, with tags that hold one number each, and a text.
std::string tiff_seed(const std::vector<std::pair<int, std::uint32_t>>& tags,
                      const std::vector<std::string>& strips, const std::string& text,
                      const std::vector<std::uint16_t>& colours = {},
                      const std::vector<std::string>& imagej = {}) {
    std::string out("II*\0\x8\0\0\0", 8);
    for (std::size_t page = 0; page < strips.size(); ++page) {
        const std::size_t at = out.size();
        std::map<int, std::pair<int, std::pair<std::uint32_t, std::uint32_t>>> all;
        for (const auto& [tag, value] : tags) all[tag] = {4, {1, value}};
        const bool has_parts = page == 0 && !imagej.empty();
        const std::size_t entries =
            tags.size() + 4 + (page == 0) + !colours.empty() + 2 * has_parts;
        std::size_t end = at + 2 + 12 * entries + 4;
        all[256] = {4, {1, 6}}, all[257] = {4, {1, 4}};
        std::string behind;
        const auto place = [&](int tag, int type, std::size_t count, const std::string& bytes) {
            all[tag] = {type,
                        {static_cast<std::uint32_t>(count),
                         static_cast<std::uint32_t>(end + behind.size())}};
            behind += bytes;
        };
        if (page == 0) place(270, 2, text.size() + 1, text + '\0');
        if (!colours.empty()) place(320, 3, colours.size(), raw(colours));
        if (has_parts) {
            std::vector<std::uint32_t> sizes;
            std::string all_parts;
            for (const std::string& part : imagej) {
                sizes.push_back(static_cast<std::uint32_t>(part.size()));
                all_parts += part;
            }
            place(50838, 4, sizes.size(), raw(sizes));
            place(50839, 1, all_parts.size(), all_parts);
        }
        all[273] = {4, {1, static_cast<std::uint32_t>(end + behind.size())}};
        all[279] = {4, {1, static_cast<std::uint32_t>(strips[page].size())}};
        behind += strips[page];
        put(out, at, static_cast<std::uint16_t>(entries));
        std::size_t entry = at + 2;
        for (const auto& [tag, what] : all) {
            put(out, entry, static_cast<std::uint16_t>(tag));
            put(out, entry + 2, static_cast<std::uint16_t>(what.first));
            put(out, entry + 4, what.second.first);
            put(out, entry + 8, what.second.second);
            entry += 12;
        }
        put(out, entry,
            static_cast<std::uint32_t>(page + 1 < strips.size() ? end + behind.size() : 0));
        out += behind;
    }
    return out;
}

std::vector<Seed> tiff_seeds() {
    const std::vector<std::pair<int, std::uint32_t>> shorts{{258, 16}, {262, 1}, {277, 1}};
    const std::vector<std::string> pages(6, raw(ramp(24)));
    const std::string ome =
        "<?xml version=\"1.0\"?><OME><Image Name=\"a\"><Pixels DimensionOrder=\"XYCZT\" "
        "SizeX=\"6\" "
        "SizeY=\"4\" SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\" PhysicalSizeX=\"0.5\">"
        "<Channel Color=\"-16776961\"/><Channel Color=\"65535\"/>"
        "<TiffData IFD=\"0\" PlaneCount=\"4\"/><TiffData IFD=\"4\" FirstZ=\"2\" PlaneCount=\"2\"/>"
        "</Pixels></Image></OME>";
    const std::string stack =
        "ImageJ=1\nimages=6\nchannels=2\nslices=3\nunit=um\nzunit=mm\nspacing=2\ncf=0\nc0=-5.5\n"
        "c1=2\nxorigin=3\nmin=0\nmax=9\n";
    std::vector<std::uint16_t> colours(48);
    for (std::size_t i = 0; i < 48; ++i) colours[i] = static_cast<std::uint16_t>(i * 1000);
    // A head that names one label, two lookup tables and the ranges of display, and these.
    const std::string head("JIJIlbal\1\0\0\0stul\2\0\0\0gnar\1\0\0\0", 28);
    const std::vector<std::string> parts{head, "ab", std::string(768, 'x'), std::string(768, 'y'),
                                         raw(std::vector<double>{0, 9, 1, 5})};
    return {{"imagej.tif", tiff_seed(shorts, pages, stack)},
            {"tables.tif", tiff_seed(shorts, pages, stack, {}, parts)},
            {"one.tif",
             tiff_seed(shorts, {raw(ramp(24 * 6)).substr(0, 48)}, stack) + raw(ramp(24 * 5))},
            {"ome.tif", tiff_seed(shorts, pages, ome)},
            {"bits.tif", tiff_seed({{258, 1}, {262, 1}}, {"abcd", "efgh"}, "a mask")},
            {"palette.tif",
             tiff_seed({{258, 4}, {262, 3}}, {"abcdefghijkl", "mnopqrstuvwx"}, "", colours)}};
}

std::string mrc_seed(std::int32_t mode, const std::string& data) {
    std::string bytes(1024, '\0');
    const std::int32_t sizes[] = {5, 4, 3, mode, 0, 0, 0, 5, 4, 3};
    for (std::size_t i = 0; i < 10; ++i) put(bytes, 4 * i, sizes[i]);
    for (std::size_t i = 0; i < 3; ++i)
        put(bytes, 40 + 4 * i, 10.0f), put(bytes, 52 + 4 * i, 90.0f);
    for (std::size_t i = 0; i < 3; ++i) put(bytes, 64 + 4 * i, static_cast<std::int32_t>(i + 1));
    put(bytes, 88, std::int32_t{1});
    bytes.replace(208, 6, "MAP DD");
    return bytes + data;
}

std::vector<Seed> text_seeds() {
    const std::string data = raw(ramp(60));
    return {
        {"a.nrrd", nrrd_seed("raw", data)},
        {"b.nrrd", nrrd_seed("gzip", zipped(data))},
        {"c.nrrd", nrrd_seed("ascii", text_of_ramp())},
        {"e.nrrd", nrrd_seed("hex", hexadecimal(data))},
        {"f.nrrd", nrrd_seed("bzip2", bzipped(data))},
        {"g.nrrd", replaced(nrrd_seed("ascii", text_of_ramp()), "short",
                            "int64\nunits: \"\" \"um\" \"um\" \"um\"")},
        {"c.vtk", vtk_fields("BINARY", data, wide_ramp())},
        {"d.vtk", vtk_fields("ASCII", text_of_ramp(), text_of_ramp())},
        {"d.vti",
         replaced(vti_seed("", "format=\"ascii\">" + text_of_ramp(), ""), "Int16", "Int64")},
        {"e.vti",
         replaced(vti_seed("", "format=\"ascii\">" + text_of_ramp(), ""), "PointData", "CellData")},
        {"d.nhdr", nrrd_seed("raw\ndata file: d%02d.raw 1 3 1", "")},
        {"a.vtk", vtk_seed("BINARY", data)},
        {"b.vtk", vtk_seed("ASCII", text_of_ramp())},
        {"a.vti", vti_seed("", "format=\"ascii\">" + text_of_ramp(), "")},
        {"b.vti", vti_seed(" header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\"",
                           "format=\"appended\" offset=\"0\">",
                           "<AppendedData encoding=\"raw\">_" + blocks_of(data))},
        {"c.vti", vti_seed("", "format=\"binary\">" + base64(raw(std::vector{120}) + data), "")},
        {"a.json", R"({"data": "d01.raw", "dims": [5, 4, 1], "type": "int16", "endian": "big",
                      "byte_offset": 0, "spacing": [1, 1, 2]})"},
        {"a.mhd",
         "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\n"
         "ElementSpacing = 1 1 2\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\n"
         "AnatomicalOrientation = RAI\nElementDataFile = d%02d.raw 1 3 1\n"},
    };
}

std::vector<Seed> binary_seeds(const Scratch& scratch) {
    const std::string data = raw(ramp(60));
    std::vector<Seed> seeds{
        {"a.nii", nifti() + data}, {"b.nii.gz", zipped(nifti() + data)}, {"a.dcm", dicom({})}};
    std::string labels = nifti() + wide_ramp();
    put(labels, 70, std::int16_t{1024});
    put(labels, 72, std::int16_t{64});
    seeds.push_back({"c.nii", labels});
    seeds.push_back({"a.mrc", mrc_seed(1, data)});
    seeds.push_back({"b.mrc", mrc_seed(12, data)});
    for (Seed& seed : tiff_seeds()) seeds.push_back(std::move(seed));
    Slice deep;
    deep.extra = element(0x8, 0x1140, "SQ", std::string("\xfe\xff\x00\xe0\0\0\0\0", 8));
    seeds.push_back({"b.dcm", dicom(deep)});
    Header what;
    what.extent = {9, 7, 1};
    const std::vector<float> values(4 * 63, 0.25f);
    for (int channels : {1, 3, 4})
        for (const char* ending : {".png", ".jpg", ".tif", ".exr", ".mha", ".nii"}) {
            if (channels == 4 && std::string_view(ending) == ".jpg") continue;
            what.volume = std::string_view(ending) == ".nii";
            what.channels = channels;
            what.colour = channels > 1;
            what.type = std::string_view(ending) == ".exr" ? Type::f32 : Type::u8;
            what.alpha = channels == 4 ? Alpha::straight : Alpha::none;
            const std::string name = std::to_string(channels) + ending;
            write(scratch.path("seed" + name), what, values.data());
            seeds.push_back({name, bytes_in(scratch.path("seed" + name))});
        }
    what = {};
    what.extent = {9, 7, 1};
    for (const std::string name : {"a.mgh", "a.mgz"}) {
        write(scratch.path("seed" + name), what, values.data());
        seeds.push_back({name, bytes_in(scratch.path("seed" + name))});
    }
    what.volume = false;
    what.channels = 3;
    for (const Format& format : formats()) {
        if (format.library.empty() || !format.writes || format.name == "EXR") continue;
        what.type = format.types.back();
        const std::string name = "a" + format.endings[0];
        write(scratch.path("seed" + name), what, values.data());
        seeds.push_back({name, bytes_in(scratch.path("seed" + name))});
    }
    what = {};
    what.extent = {5, 4, 3};
    what.type = Type::u16;
    write(scratch.path("seed.tif"), what, values.data());
    seeds.push_back({"pages.tif", bytes_in(scratch.path("seed.tif"))});
    return seeds;
}

/// One change of those that find most: bytes, extreme numbers, digits, cuts, parts twice.
void change(std::string& bytes, std::mt19937& random) {
    if (bytes.empty()) return;
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
    const std::size_t at = below(bytes.size());
    switch (below(8)) {
        case 0:
            bytes.resize(at);
            break;
        case 1: {  // an extreme number of 1 to 8 bytes
            const std::size_t width = std::size_t{1} << below(4);
            const char fill = "\xff\x7f\x80\0"[below(4)];
            for (std::size_t i = at; i < std::min(at + width, bytes.size()); ++i) bytes[i] = fill;
            break;
        }
        case 2: {  // a number of a text
            const auto digit = bytes.find_first_of("0123456789", at);
            constexpr const char* kNumbers[] = {"0",   "-1",  "65536", "4294967296",         "nan",
                                                "1e9", "inf", "999",   "4611686018427387904"};
            if (digit != bytes.npos) bytes.replace(digit, 1, kNumbers[below(9)]);
            break;
        }
        case 3:  // a part twice
            bytes.insert(at, bytes.substr(below(bytes.size()), below(64)));
            break;
        case 4:
            bytes.erase(at, 1 + below(8));
            break;
        default:
            bytes[at] = static_cast<char>(random());
            break;
    }
}

/// Reads into a block of exactly the size that was promised, so that one byte more is seen.
void read_exactly(const std::string& path) {
    Selection pick;
    pick.memory_limit = kLimit;
    const Header header = inspect(path, pick);
    if (header.times > 1) pick.time = header.times - 1;
    if (header.channels > 4) pick.channel = header.channels - 1;
    const std::size_t bytes = loaded_bytes(header, pick);
    const auto into = std::make_unique<std::byte[]>(bytes);
    read_samples(header, pick, into.get(), bytes);
    channel_colours(path);
}

int rounds() {
    const char* given = std::getenv("EDGEWISE_FUZZ_ROUNDS");
    return given ? std::atoi(given) : 120;
}

void fuzz(const Scratch& scratch, const Seed& seed) {
    std::mt19937 random(1);
    // Each of them takes two copies of the process, and the library's own code has no sanitizer.
    const Format* format = format_of(seed.name);
    const bool slow = format && !format->library.empty();
    for (int round = 0; round < (slow ? rounds() / 12 : rounds()); ++round) {
        std::string bytes = seed.bytes;
        for (int i = 0; i <= round % 4; ++i) change(bytes, random);
        const std::string path = scratch.put(seed.name, bytes);
        const auto start = std::chrono::steady_clock::now();
        Largest::reset();
        try {
            read_exactly(path);
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(seed.name), std::string::npos) << error.what();
        } catch (const RequestError&) {
        } catch (const std::exception& error) {
            ADD_FAILURE() << seed.name << " round " << round << ": " << error.what();
        }
        EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10))
            << seed.name << " round " << round;
        EXPECT_LE(Largest::bytes(), kLargest) << seed.name << " round " << round;
    }
}

TEST(Fuzz, TextHeaders) {
    Largest::watch();
    Scratch scratch;
    for (int i = 1; i <= 3; ++i) scratch.put("d0" + std::to_string(i) + ".raw", raw(ramp(20)));
    for (const Seed& seed : text_seeds()) {
        EXPECT_NO_THROW(read_exactly(scratch.put(seed.name, seed.bytes))) << seed.name;
        fuzz(scratch, seed);
    }
}

TEST(Fuzz, BinaryFiles) {
    Largest::watch();
    Scratch scratch;
    for (const Seed& seed : binary_seeds(scratch)) {
        EXPECT_NO_THROW(read_exactly(scratch.put(seed.name, seed.bytes))) << seed.name;
        fuzz(scratch, seed);
    }
}

/// Malformed files are good seeds: each is one change away from another branch.
TEST(Fuzz, SharedFiles) {
    const std::string data = shared_data();
    if (data.empty()) GTEST_SKIP() << "EDGEWISE_SHARED is not set";
    Largest::watch();
    Scratch scratch;
    scratch.put("json_short.raw", std::string(1000, '\0'));
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data)) {
        // A gigabyte of zeros in each round would take an hour.
        if (!entry.is_regular_file() || entry.file_size() > 400000 ||
            entry.path().filename().string().starts_with("nii_bomb"))
            continue;
        const std::string ending = entry.path().extension().string();
        if (ending == ".md" || ending == ".py" || ending.size() < 3 ||
            entry.path().filename() == "SHA256SUMS" || std::isdigit(ending[1]))
            continue;
        fuzz(scratch, {entry.path().filename().string(), bytes_in(entry.path().string())});
    }
}

}  // namespace
}  // namespace edgewise::store
