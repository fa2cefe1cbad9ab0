// A DICOM file, or the slices of one series of a folder, as one volume in LPS [mm].

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <numeric>

#include "graph/errors.hpp"
#include "transitions/store/dicom_file.hpp"
#include "transitions/store/geometry.hpp"
#include "transitions/store/module.hpp"
#include "transitions/store/reader.hpp"
#include "transitions/store/text.hpp"
#include "transitions/store/tiff_layout.hpp"

namespace edgewise::store {
namespace {

constexpr double kSamePlace = 1e-3;      // [mm]; positions are written with three decimals or more
constexpr double kUneven = 0.01;         // of the spacing
constexpr double kSameDirection = 1e-3;  // entries of unit vectors
constexpr double kTilt = 1e-3;           // sine between stack and slice normal

using Slices = std::vector<DicomFile>;

struct Group {
    std::string uid;
    Slices files;
};

std::vector<Group> groups_of(const std::string& folder) {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.is_regular_file() && is_dicom(entry.path().string()))
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end(), numeric_less);
    std::vector<Group> groups;
    for (const std::string& path : paths) {
        DicomFile file(path);
        auto found = std::find_if(groups.begin(), groups.end(),
                                  [&](const Group& group) { return group.uid == file.series; });
        if (found == groups.end()) found = groups.insert(groups.end(), {file.series, {}});
        found->files.push_back(std::move(file));
    }
    std::sort(groups.begin(), groups.end(),
              [](const Group& a, const Group& b) { return numeric_less(a.uid, b.uid); });
    return groups;
}

std::string text_of(const Slices& files) {
    return files[0].modality + (files[0].text.empty() ? "" : " " + files[0].text);
}

Group chosen(const std::string& folder, const Selection& pick) {
    std::vector<Group> groups = groups_of(folder);
    if (groups.empty()) refuse(folder, "holds no DICOM files");
    std::string list;
    for (std::size_t i = 0; i < groups.size(); ++i) {
        if (pick.series && (*pick.series == groups[i].uid || *pick.series == std::to_string(i)))
            return std::move(groups[i]);
        list += fmt::format("\n  {}  {}  {} files  {}", i, shown(groups[i].uid),
                            groups[i].files.size(), shown(text_of(groups[i].files)));
    }
    if (pick.series)
        throw RequestError(folder + ": no series '" + shown(*pick.series) + "'; it holds" + list);
    if (groups.size() > 1)
        throw RequestError(fmt::format("{}: holds {} series, choose one with --series{}", folder,
                                       groups.size(), list));
    return std::move(groups[0]);
}

Vector row_of(const DicomFile& f) { return {f.orientation[0], f.orientation[1], f.orientation[2]}; }
Vector column_of(const DicomFile& f) {
    return {f.orientation[3], f.orientation[4], f.orientation[5]};
}
Vector normal_of(const DicomFile& f) { return cross(row_of(f), column_of(f)); }

std::string name_of_file(const DicomFile& f) {
    return std::filesystem::path(f.path).filename().string();
}

void check_orientation(const DicomFile& f) {
    const double size = length(normal_of(f));
    if (f.has_orientation && !(size > 0.99 && size < 1.01 && length(row_of(f)) < 1.01))
        refuse(f.path,
               fmt::format("ImageOrientationPatient (0020,0037): rows and columns span {:.3g}, "
                           "expected two orthogonal unit vectors",
                           size));
}

/// All that the samples of one array must share.
void check_alike(const std::string& source, const Slices& files) {
    const DicomFile& first = files[0];
    for (const DicomFile& file : files) {
        check_orientation(file);
        const auto differ = [&](const char* what) {
            refuse(source, fmt::format("slices '{}' and '{}' of one series differ in {}",
                                       name_of_file(first), name_of_file(file), what));
        };
        if (file.rows != first.rows || file.columns != first.columns)
            refuse(source,
                   fmt::format(
                       "slices of one series must have one size: '{}' has {} x {}, '{}' {} x {}",
                       name_of_file(first), first.columns, first.rows, name_of_file(file),
                       file.columns, file.rows));
        if (file.allocated != first.allocated || file.stored != first.stored ||
            file.high != first.high || file.is_signed != first.is_signed ||
            file.samples != first.samples || file.planar != first.planar)
            differ("their sample type");
        if (file.compressed != first.compressed) differ("compression");
        if (file.big_endian != first.big_endian) differ("byte order");
        for (std::size_t i = 0; i < 6; ++i)
            if (std::abs(file.orientation[i] - first.orientation[i]) > kSameDirection)
                differ("ImageOrientationPatient (0020,0037)");
        for (std::size_t i = 0; i < 2; ++i)
            if (std::abs(file.spacing[i] / first.spacing[i] - 1) > kSameDirection)
                differ("PixelSpacing (0028,0030)");
        if (files.size() > 1 && file.frames > 1)
            differ("frames: files of several frames are read one by one");
    }
}

Type type_of(const DicomFile& f) {
    if (f.allocated == 8) return f.is_signed ? Type::i8 : Type::u8;
    if (f.allocated == 16) return f.is_signed ? Type::i16 : Type::u16;
    return f.is_signed ? Type::i32 : Type::u32;
}

/// Slices sorted by place along their normal; places that hold several (equally often) are times.
class Stack {
 public:
    Stack(const std::string& source, Slices files) : source_(source), files_(std::move(files)) {}

    void sort() {
        const Vector normal = normal_of(files_[0]);
        for (const DicomFile& file : files_)
            if (!file.has_position)
                refuse(file.path,
                       "ImagePositionPatient (0020,0032) is missing, so slices have no order");
        const auto place = [&](const DicomFile& f) { return dot(f.position, normal); };
        std::stable_sort(files_.begin(), files_.end(), [&](const DicomFile& a, const DicomFile& b) {
            return std::pair(std::round(place(a) / kSamePlace), a.instance) <
                   std::pair(std::round(place(b) / kSamePlace), b.instance);
        });
        std::vector<std::size_t> starts;
        for (std::size_t i = 0; i < files_.size(); ++i) {
            places_.push_back(place(files_[i]));
            if (i == 0 || places_[i] - places_[i - 1] > 2 * kSamePlace) starts.push_back(i);
        }
        times = static_cast<std::int64_t>(files_.size() / starts.size());
        for (std::size_t i = 0; i < starts.size(); ++i)
            if (starts[i] != i * static_cast<std::size_t>(times) ||
                starts.size() * static_cast<std::size_t>(times) != files_.size())
                same_place();
    }
    [[noreturn]] void same_place() const {
        for (std::size_t i = 1;; ++i)
            if (places_[i] - places_[i - 1] <= 2 * kSamePlace)
                refuse(source_,
                       fmt::format(
                           "slices '{}' and '{}' lie at the same position: spacing 0 between them",
                           name_of_file(files_[i - 1]), name_of_file(files_[i])));
    }
    /// The median distance, which one missing slice does not move.
    double spacing(std::vector<std::string>& warnings) const {
        std::vector<double> gaps;
        for (std::size_t i = static_cast<std::size_t>(times); i < places_.size();
             i += static_cast<std::size_t>(times))
            gaps.push_back(places_[i] - places_[i - static_cast<std::size_t>(times)]);
        std::sort(gaps.begin(), gaps.end());
        const double median = gaps[(gaps.size() - 1) / 2];
        if (gaps.back() - gaps.front() > kUneven * median)
            warnings.push_back(
                fmt::format("{}: slices lie unevenly, {:.6g} to {:.6g} mm apart; taken as {:.6g}",
                            source_, gaps.front(), gaps.back(), median));
        return median;
    }
    const Slices& files() const { return files_; }
    std::int64_t times = 1;

 private:
    std::string source_;
    Slices files_;
    std::vector<double> places_;
};

std::vector<std::string> paths_of(const Slices& files) {
    std::vector<std::string> paths;
    for (const DicomFile& file : files) paths.push_back(file.path);
    return paths;
}

/// Decoded files of compressed pixels, one after another.
class DicomReader : public Reader {
 public:
    DicomReader(Slices files, Stored stored, std::vector<ModuleImage> images)
        : files_(std::move(files)), stored_(std::move(stored)), images_(std::move(images)) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<std::string>& warnings) const override {
        std::vector<std::byte> all;
        // Slices lie in order of place, then time; only those that are wanted are decoded.
        const auto times = static_cast<std::size_t>(header.times);
        const auto per_file =
            static_cast<std::size_t>(stored_.numbers()) * bytes_of(stored_.type) / files_.size();
        all.resize(per_file);
        Stored one = stored_;
        one.axes.back().size = static_cast<std::int64_t>(files_.size() == 1 ? header.extent.z : 1);
        if (header.times > 1) one.axes.erase(one.axes.end() - 2);
        const std::size_t first = times > 1 ? static_cast<std::size_t>(pick.time.value_or(0)) : 0;
        const std::size_t slice_bytes = into.size() / (files_.size() / times);
        for (std::size_t i = first, k = 0; i < files_.size(); i += times, ++k) {
            module_read(Library::itk, files_[i].path, images_[i], all);
            MemoryStream stream(all);
            scatter(one, pick, stream, files_[i].path, into.subspan(k * slice_bytes, slice_bytes),
                    warnings);
        }
    }

    std::optional<std::vector<std::string>> files() const override { return paths_of(files_); }

 private:
    Slices files_;
    Stored stored_;
    std::vector<ModuleImage> images_;
};

/// Plain pixels whose unused high bits are cleared or take the sign; slopes of their own per slice.
class PlainReader : public Reader {
 public:
    PlainReader(Slices files, Stored stored, bool rescales)
        : files_(std::move(files)),
          inner_(stored_reader(stored)),
          type_(stored.type),
          rescales_(rescales) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<std::string>& warnings) const override {
        if (!rescales_) {
            inner_->read(header, pick, into, warnings);
            return bits(into, type_);
        }
        // f32 slices are filled from stored numbers read into their own upper part.
        const std::int64_t count = header.extent.x * header.extent.y;
        const auto times = static_cast<std::size_t>(header.times);
        Bytes slice(static_cast<std::size_t>(count) * bytes_of(type_));
        std::size_t to = 0;
        for (std::size_t i = pick.time.value_or(0); i < files_.size();
             i += times, to += static_cast<std::size_t>(count) * 4) {
            const File file(files_[i].path);
            file.read(files_[i].pixels, slice, "pixel data");
            if (files_[i].big_endian) swap_bytes(slice.data(), bytes_of(type_), count);
            bits(slice, type_);
            rescale(slice, files_[i], into.data() + to, count);
        }
    }

    std::optional<std::vector<std::string>> files() const override { return paths_of(files_); }

 private:
    template <class T>
    void bits_as(std::span<std::byte> samples) const {
        const DicomFile& f = files_[0];
        const int up = f.allocated - 1 - f.high, down = f.allocated - f.stored;
        for (std::size_t i = 0; i + sizeof(T) <= samples.size(); i += sizeof(T)) {
            T value;
            std::memcpy(&value, samples.data() + i, sizeof value);
            using Unsigned = std::make_unsigned_t<T>;
            const auto shifted = static_cast<T>(static_cast<Unsigned>(
                static_cast<std::uint64_t>(static_cast<Unsigned>(value)) << up));
            value = static_cast<T>(shifted >> down);
            std::memcpy(samples.data() + i, &value, sizeof value);
        }
    }
    void bits(std::span<std::byte> samples, Type type) const {
        if (files_[0].stored == files_[0].allocated) return;
        if (type == Type::u8) bits_as<std::uint8_t>(samples);
        if (type == Type::i8) bits_as<std::int8_t>(samples);
        if (type == Type::u16) bits_as<std::uint16_t>(samples);
        if (type == Type::i16) bits_as<std::int16_t>(samples);
    }
    void rescale(const Bytes& slice, const DicomFile& f, std::byte* into,
                 std::int64_t count) const {
        for (std::int64_t i = 0; i < count; ++i) {
            const float value = static_cast<float>(
                f.slope * number(slice.data() + static_cast<std::size_t>(i) * bytes_of(type_)) +
                f.intercept);
            std::memcpy(into + i * 4, &value, sizeof value);
        }
    }
    double number(const std::byte* at) const {
        const auto as = [&]<class T>(T value) {
            std::memcpy(&value, at, sizeof value);
            return static_cast<double>(value);
        };
        switch (type_) {
            case Type::u8:
                return as(std::uint8_t{});
            case Type::i8:
                return as(std::int8_t{});
            case Type::u16:
                return as(std::uint16_t{});
            case Type::i16:
                return as(std::int16_t{});
            case Type::u32:
                return as(std::uint32_t{});
            default:
                return as(std::int32_t{});
        }
    }

    Slices files_;
    std::shared_ptr<const Reader> inner_;
    Type type_;
    bool rescales_;
};

void take_geometry(Header& header, const Stack& stack) {
    const DicomFile& first = stack.files().front();
    const DicomFile& last = stack.files().back();
    header.unit = first.has_spacing ? "mm" : "";
    header.anatomical = first.has_orientation && first.has_position;
    header.origin = first.position;
    double step = first.thickness > 0 ? first.thickness : 1;
    Vector z = normal_of(first);
    if (header.extent.z > 1 && first.frames == 1) {
        step = stack.spacing(header.warnings);
        Vector along;
        for (int row = 0; row < 3; ++row) along[row] = last.position[row] - first.position[row];
        const double size = length(along);
        for (double& entry : along) entry /= size;
        if (length(cross(along, z)) > kTilt) {
            header.warnings.push_back(header.file +
                                      ": the stack leans against its slices (tilted gantry)");
            step /= dot(along, z);
            z = along;
        }
    } else if (header.extent.z > 1) {
        header.warnings.push_back(
            fmt::format("{}: distance of the frames taken as {} mm", header.file, step));
    }
    std::array<Vector, 3> columns{row_of(first), column_of(first), z};
    const Vector spacing{first.spacing[1], first.spacing[0], step};
    take_steps(header, columns, "ImageOrientationPatient (0020,0037)");
    header.spacing = spacing;
    check_spacing(header, "PixelSpacing (0028,0030)");
}

void take_values(Header& header, Stored& stored, const Slices& files, bool& rescales) {
    const DicomFile& first = files[0];
    for (const DicomFile& file : files)
        rescales |= file.slope != first.slope || file.intercept != first.intercept;
    if (rescales && first.samples > 1)
        refuse(header.file, "colour slices with slopes of their own are not supported");
    if (!rescales) header.values = {first.slope, first.intercept};
    const std::string& meaning = first.photometric;
    if (meaning == "MONOCHROME1")
        header.warnings.push_back(header.file +
                                  ": MONOCHROME1: small values are bright; kept as stored");
    if (!first.compressed && meaning != "MONOCHROME1" && meaning != "MONOCHROME2" &&
        meaning != "RGB")
        refuse(header.file,
               "PhotometricInterpretation (0028,0004) is '" + shown(meaning) + "': not supported");
    header.labels = first.sop_class == "1.2.840.10008.5.1.4.1.1.66.4";  // segmentation storage
    stored.type = type_of(first);
    stored.big_endian = first.big_endian;
}

std::vector<Axis> axes_of(const DicomFile& first, std::int64_t slices, std::int64_t times) {
    std::vector<Axis> axes{{Axis::x, first.columns}, {Axis::y, first.rows}};
    if (first.samples > 1 && (first.planar == 0 || first.compressed))
        axes.insert(axes.begin(), {Axis::channel, first.samples});
    else if (first.samples > 1)
        axes.push_back({Axis::channel, first.samples});
    if (times > 1) axes.push_back({Axis::time, times});
    axes.push_back({Axis::z, slices});
    return axes;
}

void compressed(Header& header, Stored& stored, const Slices& files) {
    std::vector<ModuleImage> images;
    for (const DicomFile& file : files) {
        images.push_back(module_inspect(Library::itk, file.path));
        const ModuleImage& image = images.back();
        if (image.size[0] != file.columns || image.size[1] != file.rows ||
            image.size[2] != file.frames || image.channels != file.samples ||
            image.type != images[0].type)
            refuse(file.path,
                   "its compressed pixels have another size or type than its header says");
    }
    stored.type = static_cast<Type>(images[0].type);
    for (const DicomFile& file : files)
        check_density(file.path, file.rows * file.columns * file.samples * file.frames,
                      file.pixel_bytes, kDensest);
    header.type = stored.type;
    header.values = {};  // the decoder applies slope and intercept
    header.reading_bytes = bytes_of(Library::itk) + static_cast<std::size_t>(stored.numbers()) *
                                                        bytes_of(stored.type) / files.size() * 3;
    header.reader = std::make_shared<const DicomReader>(files, stored, std::move(images));
}

}  // namespace

bool is_dicom(const std::string& path) {
    const File file(path);
    std::byte marker[132];
    return file.size() > 140 && file.read_some(0, marker) == 132 &&
           std::memcmp(marker + 128, "DICM", 4) == 0;
}

Header inspect_dicom(const std::string& path, const Selection& pick) {
    Header header;
    header.file = path;
    header.format = "DICOM";
    const bool folder = std::filesystem::is_directory(path);
    Slices files;
    if (folder)
        files = chosen(path, pick).files;
    else
        files.emplace_back(path);
    check_alike(path, files);
    Stack stack(path, std::move(files));
    if (stack.files().size() > 1) stack.sort();
    const DicomFile& first = stack.files()[0];
    header.volume = folder || first.frames > 1;
    Stored stored;
    bool rescales = false;
    take_values(header, stored, stack.files(), rescales);
    const std::int64_t slices = first.frames > 1
                                    ? first.frames
                                    : static_cast<std::int64_t>(stack.files().size()) / stack.times;
    stored.axes = axes_of(first, slices, stack.times);
    for (const DicomFile& file : stack.files()) stored.pieces.push_back({file.path, file.pixels});
    take_axes(header, stored);
    take_geometry(header, stack);
    if (first.compressed) {
        compressed(header, stored, stack.files());
        return header;
    }
    check_pieces(path, stored);
    if (rescales) header.type = Type::f32;
    header.reader = std::make_shared<const PlainReader>(stack.files(), stored, rescales);
    return header;
}

std::vector<Series> list_series(const std::string& source) {
    std::vector<Series> list;
    if (!std::filesystem::is_directory(source)) return tiff_series(source);
    for (const Group& group : groups_of(source))
        list.push_back({group.uid, text_of(group.files), static_cast<int>(group.files.size())});
    return list;
}

}  // namespace edgewise::store
