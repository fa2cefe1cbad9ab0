// A DICOM file, or the slices of one series of a folder, as one volume in LPS [mm].

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <type_traits>

#include "graph/errors.hpp"
#include "io/dicom_copies.hpp"
#include "io/dicom_file.hpp"
#include "io/dicom_pixels.hpp"
#include "io/dicom_segments.hpp"
#include "io/dicom_stack.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"
#include "io/tiff_layout.hpp"

namespace edgewise::store {
namespace {

using Files = std::vector<DicomFile>;

struct Group {
    std::string uid;
    Files files;
};

/// What a folder holds.
struct Study {
    std::vector<Group> series;  // of pictures
    std::vector<Group> others;  // structures, plans, reports, directories: no pixels
    std::vector<std::pair<std::string, std::string>> damaged;  // series where known, message

    std::string skipped() const;
};

std::string Study::skipped() const {
    std::map<std::string, std::vector<std::string>> kinds;
    for (const Group& group : others)
        for (const DicomFile& file : group.files)
            kinds[file.kind_of_object()].push_back(
                std::filesystem::path(file.path).filename().string());
    std::string text;
    for (const auto& [kind, names] : kinds)
        text += fmt::format("{}{} ('{}'{})", text.empty() ? "" : ", ", kind, shown(names[0]),
                            names.size() > 1 ? fmt::format(" and {} more", names.size() - 1) : "");
    return text;
}

Group& group_of(std::vector<Group>& groups, const std::string& uid) {
    for (Group& group : groups)
        if (group.uid == uid) return group;
    return groups.emplace_back(Group{uid, {}});
}

template <class Iterator>
std::vector<std::string> dicom_files(Iterator entries) {
    std::vector<std::string> paths;
    for (const auto& entry : entries)
        if (entry.is_regular_file() && !entry.path().filename().string().starts_with('.') &&
            is_dicom(entry.path().string()))
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end(), numeric_less);
    return paths;
}

Study study_of(const std::vector<std::string>& paths) {
    Study study;
    for (const std::string& path : paths) {
        std::string damage;
        DicomFile file(path, damage);
        if (!damage.empty()) {
            study.damaged.emplace_back(file.series, damage);
            continue;
        }
        const bool pixels = file.kind != DicomFile::Pixels::none;
        Group& group = group_of(pixels ? study.series : study.others, file.series);
        group.files.push_back(std::move(file));
    }
    for (auto* groups : {&study.series, &study.others})
        std::sort(groups->begin(), groups->end(),
                  [](const Group& a, const Group& b) { return numeric_less(a.uid, b.uid); });
    return study;
}

Study study_in(const std::string& folder) {
    namespace fs = std::filesystem;
    Study study = study_of(dicom_files(fs::directory_iterator(folder)));
    // A medium with a directory (PS3.10) keeps its pictures in folders below.
    const bool medium = std::any_of(study.others.begin(), study.others.end(), [](const Group& g) {
        return g.files[0].kind_of_object() == "DICOMDIR";
    });
    if (!study.series.empty() || !medium) return study;
    return study_of(dicom_files(fs::recursive_directory_iterator(folder)));
}

std::string text_of(const Files& files) {
    return files[0].modality + (files[0].text.empty() ? "" : " " + files[0].text);
}

/// A damaged file may be a slice of the series: what is left of it would be a wrong volume.
void expect_whole(const Study& study, const std::string& uid, Header& header) {
    for (const auto& [series, message] : study.damaged) {
        if (series.empty() || series == uid) throw InputError(message);
        header.warnings.push_back("skipped, of another series: " + message);
    }
}

Group chosen(const std::string& folder, const Selection& pick, Header& header) {
    Study study = study_in(folder);
    const std::string skipped = study.skipped();
    if (study.series.empty() && !study.damaged.empty()) throw InputError(study.damaged[0].second);
    if (study.series.empty())
        refuse(folder,
               skipped.empty() ? "holds no DICOM files" : "holds no pictures, but " + skipped);
    if (!skipped.empty())
        header.warnings.push_back(folder + ": holds no pictures and is skipped: " + skipped);
    std::string list;
    for (std::size_t i = 0; i < study.series.size(); ++i) {
        Group& group = study.series[i];
        if (pick.series && (*pick.series == group.uid || *pick.series == std::to_string(i))) {
            expect_whole(study, group.uid, header);
            return std::move(group);
        }
        list += fmt::format("\n  {}  {}  {} files  {}", i, shown(group.uid), group.files.size(),
                            shown(text_of(group.files)));
    }
    for (const Group& group : study.others)
        if (pick.series && *pick.series == group.uid)
            throw RequestError(
                fmt::format("{}: series '{}' holds no pictures, but {}; pictures are{}", folder,
                            shown(group.uid), group.files[0].kind_of_object(), list));
    if (pick.series)
        throw RequestError(folder + ": no series '" + shown(*pick.series) + "'; it holds" + list);
    if (study.series.size() > 1)
        throw RequestError(message("{}: holds {} series, choose one with @series{}", folder,
                                   study.series.size(), list));
    expect_whole(study, study.series[0].uid, header);
    return std::move(study.series[0]);
}

/// What the numbers of one frame mean (PS3.3 C.11.1, C.7.6.16.2.9, C.8.8.3).
ValueMap values_of(const DicomFile& file, std::int64_t k) {
    const bool looked_up = !file.modality_table.descriptor.empty();
    if (sample_channels(file) > 1 || looked_up) return {};
    if (file.dose_scaling > 0) return {file.dose_scaling, 0};
    if (file.fractional) return {1 / std::max(1.0, file.most_fraction), 0};
    const DicomFrame frame = file.frame(k);
    if (frame.slope || frame.intercept)
        return {frame.slope.value_or(1), frame.intercept.value_or(0)};
    if (frame.world_slope && *frame.world_slope != 0)
        return {*frame.world_slope, frame.world_intercept.value_or(0)};
    return {};
}

template <class F>
void with_number(Type type, F use) {
    switch (type) {
        case Type::u8:
            return use(std::uint8_t{});
        case Type::i8:
            return use(std::int8_t{});
        case Type::u16:
            return use(std::uint16_t{});
        case Type::i16:
            return use(std::int16_t{});
        case Type::u32:
            return use(std::uint32_t{});
        case Type::i32:
            return use(std::int32_t{});
        case Type::f64:
            return use(double{});
        default:
            return use(float{});
    }
}

using Range = std::array<double, 2>;

class DicomReader : public Reader {
 public:
    DicomReader(Files files, DicomStack stack, Type stored, bool rescales)
        : files_(std::move(files)), stack_(std::move(stack)), type_(stored), rescales_(rescales) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override {
        Planes planes(*this, header, pick.padding != Padding::stored);
        Stored one;
        one.type = rescales_ ? Type::f32 : type_;
        one.axes = {
            {Axis::channel, header.channels}, {Axis::x, stack_.columns}, {Axis::y, stack_.rows}};
        const std::size_t slice = into.size() / static_cast<std::size_t>(stack_.slices);
        for (std::int64_t z = 0; z < stack_.slices; ++z) {
            const auto& plane = stack_.plane(z, stack_.times > 1 ? pick.time.value_or(0) : 0);
            const auto place = into.subspan(static_cast<std::size_t>(z) * slice, slice);
            if (is_missing(z)) {
                std::fill(place.begin(), place.end(), std::byte{0});
                continue;
            }
            MemoryStream stream(planes.samples(plane));
            scatter(one, pick, stream, header.file, place, warnings);
        }
        if (planes.overlaps > 0)
            warnings.push_back(
                fmt::format("{}: {} samples belong to several segments; the one "
                            "that comes last in the file counts",
                            header.file, planes.overlaps));
        if (header.channels > 1) return;
        const bool marked = pick.padding != Padding::stored && files_[0].padding;
        if (marked || has_missing())
            with_number(loaded_type(header.type, pick.as_stored), [&]<class T>(T) {
                fill_padding(std::span(reinterpret_cast<T*>(into.data()), into.size() / sizeof(T)),
                             header, pick, warnings);
            });
    }

    PaddingRuns padding(const Header& header, const Selection& pick) const override {
        PaddingRuns found;
        const bool missing = has_missing();
        if (header.channels > 1 || (!files_[0].padding && !missing)) return found;
        const Range range = files_[0].padding.value_or(Range{1, 0});
        if (files_[0].padding) found.value = values_of(files_[0], 0)(range[0]);
        const auto add = [&](std::int64_t at, std::int64_t count) {
            const bool next =
                !found.runs.empty() && found.runs.back().first + found.runs.back().count == at;
            if (next)
                found.runs.back().count += count;
            else
                found.runs.push_back({at, count});
        };
        Planes planes(*this, header, true);
        const std::int64_t slice = stack_.columns * stack_.rows;
        for (std::int64_t z = 0; z < stack_.slices; ++z) {
            if (is_missing(z)) add(z * slice, slice);
            if (is_missing(z) || !files_[0].padding) continue;
            const std::span<const std::byte> bytes =
                planes.samples(stack_.plane(z, stack_.times > 1 ? pick.time.value_or(0) : 0));
            with_number(rescales_ ? Type::f32 : type_, [&]<class T>(T) {
                for (std::int64_t i = 0; i < slice; ++i) {
                    T sample;
                    std::memcpy(&sample, bytes.data() + static_cast<std::size_t>(i) * sizeof(T),
                                sizeof sample);
                    const auto number = static_cast<double>(sample);
                    if (rescales_ ? sample != sample : number >= range[0] && number <= range[1])
                        add(z * slice + i, 1);
                }
            });
        }
        return found;
    }

    std::optional<std::vector<std::string>> files() const override {
        std::vector<std::string> paths;
        for (const DicomFile& file : files_) paths.push_back(file.path);
        return paths;
    }

 private:
    /// Makes planes of frames; the file that was read last stays open.
    class Planes {
     public:
        Planes(const DicomReader& reader, const Header& header, bool marks)
            : reader_(reader),
              width_(bytes_of(reader.type_) * static_cast<std::size_t>(header.channels)),
              marks_(marks) {}

        std::span<const std::byte> samples(const std::vector<DicomPiece>& pieces) {
            const DicomStack& stack = reader_.stack_;
            const auto pixels = static_cast<std::size_t>(stack.columns * stack.rows);
            std::span<const std::byte> plane;
            const bool whole = pieces.size() == 1 && !stack.labels &&
                               pieces[0].columns == reader_.files_[pieces[0].file].columns &&
                               pieces[0].rows == reader_.files_[pieces[0].file].rows;
            if (whole) {
                plane = frame(pieces[0]);
            } else {
                plane_.assign(pixels * width_, std::byte{0});
                for (const DicomPiece& piece : pieces)
                    stack.labels ? put_labels(piece) : put(piece);
                plane = plane_;
            }
            return reader_.rescales_ ? rescaled(plane, pieces[0]) : plane;
        }
        std::int64_t overlaps = 0;

     private:
        std::span<const std::byte> frame(const DicomPiece& piece) {
            if (!frames_ || piece.file != file_) frames_.emplace(reader_.files_[piece.file]);
            file_ = piece.file;
            return frames_->frame(piece.frame);
        }
        void put(const DicomPiece& piece) {
            const std::span<const std::byte> from = frame(piece);
            const std::int64_t columns = reader_.files_[piece.file].columns;
            const auto run = static_cast<std::size_t>(piece.columns) * width_;
            for (std::int64_t y = 0; y < piece.rows; ++y)
                std::memcpy(plane_.data() + width_ * static_cast<std::size_t>(
                                                         (piece.to_y + y) * reader_.stack_.columns +
                                                         piece.to_x),
                            from.data() + width_ * static_cast<std::size_t>(
                                                       (piece.from_y + y) * columns + piece.from_x),
                            run);
        }
        void put_labels(const DicomPiece& piece) {
            const std::span<const std::byte> ones = frame(piece);
            with_number(reader_.type_, [&]<class T>(T) {
                const auto label = static_cast<T>(piece.segment);
                for (std::size_t i = 0; i < ones.size(); ++i) {
                    if (ones[i] == std::byte{0}) continue;
                    T before;
                    std::memcpy(&before, plane_.data() + i * sizeof(T), sizeof(T));
                    overlaps += before != 0 && before != label;
                    std::memcpy(plane_.data() + i * sizeof(T), &label, sizeof(T));
                }
            });
        }
        /// Values in f32; padding becomes NaN where it is to be replaced.
        std::span<const std::byte> rescaled(std::span<const std::byte> plane,
                                            const DicomPiece& piece) {
            const DicomFile& file = reader_.files_[piece.file];
            const ValueMap map = values_of(file, piece.frame);
            const Range padding = file.padding.value_or(Range{1, 0});
            with_number(reader_.type_, [&]<class T>(T) {
                const std::size_t count = plane.size() / sizeof(T);
                values_.resize(count * sizeof(float));
                for (std::size_t i = 0; i < count; ++i) {
                    T stored;
                    std::memcpy(&stored, plane.data() + i * sizeof(T), sizeof stored);
                    const auto number = static_cast<double>(stored);
                    float value = static_cast<float>(map(number));
                    if (marks_ && number >= padding[0] && number <= padding[1])
                        value = std::numeric_limits<float>::quiet_NaN();
                    std::memcpy(values_.data() + i * sizeof value, &value, sizeof value);
                }
            });
            return values_;
        }

        const DicomReader& reader_;
        std::size_t width_;
        bool marks_;
        std::optional<DicomFrames> frames_;
        std::size_t file_ = 0;
        Bytes plane_, values_;
    };

    bool is_missing(std::int64_t slice) const {
        return !stack_.labels && stack_.plane(slice, 0).empty();
    }

    bool has_missing() const {
        for (std::int64_t z = 0; z < stack_.slices; ++z)
            if (is_missing(z)) return true;
        return false;
    }

    /// Samples that are no measurements take the value that they are to count as: those that the
    /// file calls padding, unless they are kept as stored, and those of missing slices.
    template <class T>
    void fill_padding(std::span<T> samples, const Header& header, const Selection& pick,
                      std::vector<Message>& warnings) const {
        const bool keeps = pick.padding == Padding::stored;
        const bool marked = !keeps && files_[0].padding;
        const Range range = files_[0].padding.value_or(Range{1, 0});
        const auto is_padding = [&](T sample) {
            if (!marked) return false;
            if (rescales_) return sample != sample;
            const auto number = static_cast<double>(sample);
            return number >= range[0] && number <= range[1];
        };
        const std::size_t slice = samples.size() / static_cast<std::size_t>(stack_.slices);
        const auto of_slice = [&](std::int64_t z) {
            return samples.subspan(static_cast<std::size_t>(z) * slice, slice);
        };
        double smallest = std::numeric_limits<double>::infinity(), largest = -smallest;
        std::size_t count = 0, missing = 0;
        for (std::int64_t z = 0; z < stack_.slices; ++z) {
            if (is_missing(z)) {
                missing += slice;
                continue;
            }
            for (const T sample : of_slice(z)) {
                if (is_padding(sample)) {
                    ++count;
                    continue;
                }
                const double value = header.values(static_cast<double>(sample));
                smallest = std::min(smallest, value);
                largest = std::max(largest, value);
            }
        }
        if (count + missing == 0) return;
        const bool all = count + missing == samples.size();
        if (count > 0)
            warnings.push_back(
                fmt::format("{}: {}{} samples are padding (0028,0120), no "
                            "measurements",
                            header.file, all ? "all " : "", count));
        if (!(smallest <= largest)) smallest = largest = 0;
        double value = pick.padding == Padding::largest ? largest : smallest;
        if (pick.padding == Padding::nothing || keeps)
            value = pick.nothing.value_or(std::min(0.0, smallest));
        // Beside padding that stays, missing slices are padding too.
        if (keeps && files_[0].padding && !rescales_) value = header.values(range[0]);
        const T filled = nearest_to<T>(value, header, warnings);
        for (std::int64_t z = 0; z < stack_.slices; ++z)
            for (T& sample : of_slice(z))
                if (is_missing(z) || is_padding(sample)) sample = filled;
    }
    /// The stored number of a value, as near as its type holds it.
    template <class T>
    T nearest_to(double value, const Header& header, std::vector<Message>& warnings) const {
        const double stored = (value - header.values.offset) / header.values.slope;
        if constexpr (std::is_integral_v<T>) {
            const double nearest =
                std::clamp(std::nearbyint(stored), double(std::numeric_limits<T>::lowest()),
                           double(std::numeric_limits<T>::max()));
            if (header.values(nearest) != value && std::abs(nearest - stored) > 1e-6)
                warnings.push_back(
                    fmt::format("{}: padding counts as {:.6g}, the nearest to {:.6g} "
                                "that its type holds",
                                header.file, header.values(nearest), value));
            return static_cast<T>(nearest);
        } else {
            return static_cast<T>(stored);
        }
    }

    Files files_;
    DicomStack stack_;
    Type type_;  // of decoded frames, or of labels
    bool rescales_;
};

/// Whether each frame has values of its own, so that only numbers in f32 can hold them all.
bool takes_values(Header& header, const Files& files, const DicomStack& stack) {
    if (stack.labels) return false;
    const DicomPiece& first = stack.planes[0][0];
    header.values = values_of(files[first.file], first.frame);
    bool differ = false;
    for (const auto& plane : stack.planes)
        for (const DicomPiece& piece : plane) {
            const ValueMap map = values_of(files[piece.file], piece.frame);
            if (map.slope == 0) refuse(files[piece.file].path, "RescaleSlope (0028,1053) is 0");
            differ |= map != header.values;
        }
    for (const DicomFile& file : files) differ |= file.padding != files[0].padding;
    if (differ) header.values = {};
    return differ && header.channels == 1;
}

}  // namespace

Header inspect_dicom(const std::string& path, const Selection& pick) {
    Header header;
    header.file = path;
    header.format = "DICOM";
    const bool folder = std::filesystem::is_directory(path);
    Files files;
    if (folder)
        files = chosen(path, pick, header).files;
    else
        files.emplace_back(path);
    if (files[0].kind == DicomFile::Pixels::none)
        refuse(path, "pixel data (7fe0,0010) are missing: it is " + files[0].kind_of_object() +
                         ", no picture");
    for (const DicomFile& file : files) DicomFrames check(file);
    if (files.size() > 1) leave_out_copies(files, header);
    const DicomFile& first = files[0];
    DicomStack stack = stack_of(files, folder, header);
    if (first.photometric == "MONOCHROME1")
        header.warnings.push_back(header.file +
                                  ": MONOCHROME1: small values are bright; kept as stored");
    // Label maps hold labels in their samples, other segmentations a picture for each label.
    header.labels |= first.sop_class == "1.2.840.10008.5.1.4.1.1.66.7";
    if (header.labels) header.segments = dicom_segments(first);
    Type type = sample_type(first);
    if (stack.labels) type = stack.most_label > 255 ? Type::u16 : Type::u8;

    Stored shape;
    shape.type = type;
    shape.axes = {{Axis::channel, sample_channels(first)},
                  {Axis::x, stack.columns},
                  {Axis::y, stack.rows},
                  {Axis::z, stack.slices},
                  {Axis::time, stack.times}};
    take_axes(header, shape);
    header.colour = header.channels == 3;
    const bool rescales = takes_values(header, files, stack);
    if (rescales) header.type = Type::f32;
    header.reading_bytes =
        decoding_bytes(first) + 8 * static_cast<std::size_t>(stack.columns * stack.rows);
    header.reader =
        std::make_shared<const DicomReader>(std::move(files), std::move(stack), type, rescales);
    return header;
}

std::vector<Series> list_series(const std::string& source) {
    std::vector<Series> list;
    if (!std::filesystem::is_directory(source)) return tiff_series(source);
    for (const Group& group : study_in(source).series)
        list.push_back({group.uid, text_of(group.files), static_cast<int>(group.files.size())});
    return list;
}

}  // namespace edgewise::store
