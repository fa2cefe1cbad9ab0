// Where the frames of a series lie, and in which order they make a volume (PS3.3 C.7.6.2,
// C.7.6.16).

#include "io/dicom_stack.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "io/geometry.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

// Positions are written with three decimals or more; of pixels below 0.1 mm a hundredth is less.
constexpr double kSamePlace = 1e-3;            // [mm]
constexpr double kOfPixel = 0.01;              // of the pixel spacing
constexpr double kUneven = 0.01;               // of the spacing
constexpr double kSameDirection = 1e-3;        // entries of unit vectors
constexpr double kTilt = 1e-3;                 // sine between stack and slice normal
constexpr double kAside = 0.1, kFarAside = 1;  // of a pixel
constexpr double kOffGrid = 0.1;               // of the spacing
constexpr double kMostOffGrid = 0.35;          // the same, of places written with few digits
constexpr double kFar = 1e6;                   // of the spacing: no series has so many slices

constexpr std::array<double, 6> kUpright{1, 0, 0, 0, 1, 0};

std::string name_of_file(const DicomFile& f) {
    return std::filesystem::path(f.path).filename().string();
}

/// The unit of its values: DICOM's terms (Rescale Type, and Units of PET) as one writes them.
std::string value_unit_of(const DicomFile& f) {
    struct Term {
        const char *term, *unit;
    };
    constexpr Term kTerms[] = {
        {"HU", "HU"},      {"OD", "OD"},        {"MGML", "mg/ml"},       {"PCT", "%"},
        {"BQML", "Bq/ml"}, {"CNTS", "counts"},  {"GML", "g/ml"},         {"CPS", "counts/s"},
        {"PCNT", "%"},     {"CM2ML", "cm2/ml"}, {"MGMINML", "mg/min/ml"}};
    if (!f.modality_table.descriptor.empty()) return "";  // which has types of its own
    const std::string& said = f.units.empty() ? f.rescale_type : f.units;
    for (const Term& one : kTerms)
        if (said == one.term) return one.unit;
    // PS3.3 C.8.2.1.1.2: of CT images Hounsfield units, where nothing else is said.
    return said.empty() && f.modality == "CT" ? "HU" : "";
}

Vector row_of(const DicomFrame& f) {
    const auto& o = f.orientation.value_or(kUpright);
    return {o[0], o[1], o[2]};
}
Vector column_of(const DicomFrame& f) {
    const auto& o = f.orientation.value_or(kUpright);
    return {o[3], o[4], o[5]};
}
Vector normal_of(const DicomFrame& f) { return cross(row_of(f), column_of(f)); }

Vector moved(Vector at, double by, const Vector& along) {
    for (int axis = 0; axis < 3; ++axis) at[axis] += by * along[axis];
    return at;
}

/// A plane before it has its place in the volume.
struct Plane {
    std::vector<DicomPiece> pieces;
    std::optional<Vector> position;
    std::int64_t temporal = 0;
    std::vector<double> dimensions;
    std::int64_t instance = 0;
    std::string acquired;
    double place = 0;         // along the normal [mm]
    std::size_t cluster = 0;  // which of the places

    /// In which order what lies at one place was taken.
    auto order() const {
        return std::tie(temporal, dimensions, instance, acquired, pieces[0].file, pieces[0].frame);
    }
};

class Builder {
 public:
    Builder(const std::vector<DicomFile>& files, bool folder, Header& header)
        : files_(files), folder_(folder), header_(header), first_(files[0].frame(0)) {}

    DicomStack build() {
        check_alike();
        for (std::size_t i = 0; i < files_.size(); ++i) {
            const DicomFile& file = files_[i];
            if (is_mosaic(file))
                add_mosaics(i);
            else if (file.total_columns > file.columns || file.total_rows > file.rows)
                add_tiles(i);
            else
                add_frames(i);
        }
        place_all();
        find_places();
        if (is_segmentation(files_[0]) && !files_[0].fractional)
            join_segments();
        else
            make_times();
        if (!stack_.labels) keep_missing_places();
        take_geometry();
        return std::move(stack_);
    }

 private:
    void warn(const std::string& what) { header_.warnings.push_back(header_.file + ": " + what); }
    [[noreturn]] void differ(const DicomFile& file, const char* what) const {
        refuse(header_.file, fmt::format("slices '{}' and '{}' of one series differ in {}",
                                         name_of_file(files_[0]), name_of_file(file), what));
    }

    static bool is_segmentation(const DicomFile& file) {
        return file.sop_class == "1.2.840.10008.5.1.4.1.1.66.4";
    }
    static bool is_mosaic(const DicomFile& file) {
        const auto words = split(file.image_type, '\\');
        return std::find(words.begin(), words.end(), "MOSAIC") != words.end();
    }

    /// All that the samples of one array must share.
    void check_alike() const {
        const DicomFile& first = files_[0];
        for (const DicomFile& file : files_) {
            if (file.rows != first.rows || file.columns != first.columns)
                refuse(header_.file,
                       fmt::format("slices of one series must have one size: '{}' has {} x {}, "
                                   "'{}' {} x {}",
                                   name_of_file(first), first.columns, first.rows,
                                   name_of_file(file), file.columns, file.rows));
            if (file.allocated != first.allocated || file.stored != first.stored ||
                file.high != first.high || file.is_signed != first.is_signed ||
                file.samples != first.samples || file.kind != first.kind)
                differ(file, "their sample type");
            if (file.photometric != first.photometric && file.samples == 1)
                differ(file, "PhotometricInterpretation (0028,0004)");
            // Frames of which none says anything of its own are as the first.
            const std::int64_t said =
                std::max<std::int64_t>(1, static_cast<std::int64_t>(file.each.size()));
            for (std::int64_t k = 0; k < said; ++k) check_frame(file, k);
        }
    }
    void check_frame(const DicomFile& file, std::int64_t k) const {
        const DicomFrame frame = file.frame(k);
        const double size = length(normal_of(frame));
        if (!(size > 0.99 && size < 1.01 && length(row_of(frame)) < 1.01))
            refuse(file.path,
                   fmt::format("ImageOrientationPatient (0020,0037): rows and columns span {:.3g}, "
                               "expected two orthogonal unit vectors",
                               size));
        const auto orientation = frame.orientation.value_or(kUpright);
        const auto expected = first_.orientation.value_or(kUpright);
        for (std::size_t i = 0; i < 6; ++i)
            if (std::abs(orientation[i] - expected[i]) > kSameDirection)
                differ(file, "ImageOrientationPatient (0020,0037)");
        if (frame.spacing.has_value() != first_.spacing.has_value())
            differ(file, "PixelSpacing (0028,0030)");
        for (std::size_t i = 0; i < 2 && frame.spacing; ++i)
            if (std::abs((*frame.spacing)[i] / (*first_.spacing)[i] - 1) > kSameDirection)
                differ(file, "PixelSpacing (0028,0030)");
    }

    /// Distance of slices where no positions say it, with a word where it is guessed.
    double step_of(const DicomFrame& frame) {
        if (frame.between && *frame.between != 0) return *frame.between;
        if (frame.thickness && *frame.thickness > 0) {
            guessed_ =
                fmt::format("distance of slices taken from SliceThickness (0018,0050) as {} mm",
                            *frame.thickness);
            return *frame.thickness;
        }
        guessed_ = "nothing says how far slices lie from each other; taken as 1";
        return 1;
    }

    Plane plane_of(std::size_t index, std::int64_t k, const DicomFrame& frame) const {
        const DicomFile& file = files_[index];
        Plane plane;
        plane.pieces.push_back({.file = index,
                                .frame = k,
                                .columns = file.columns,
                                .rows = file.rows,
                                .segment = frame.segment});
        plane.temporal = frame.temporal;
        plane.dimensions = frame.dimensions;
        plane.instance = file.instance;
        plane.acquired = file.acquired;
        return plane;
    }

    void add_frames(std::size_t index) {
        const DicomFile& file = files_[index];
        // Where some frames say where they lie, all must.
        const bool placed =
            file.frames == 1 || file.shared.position ||
            std::any_of(file.each.begin(), file.each.end(),
                        [](const DicomFrame& frame) { return frame.position.has_value(); });
        for (std::int64_t k = 0; k < file.frames; ++k) {
            const DicomFrame frame = file.frame(k);
            Plane plane = plane_of(index, k, frame);
            const bool own = file.frames == 1 || file.shared.position ||
                             (static_cast<std::size_t>(k) < file.each.size() &&
                              file.each[static_cast<std::size_t>(k)].position);
            if (!placed)
                plane.position = implied(file, k, frame);
            else if (own)
                plane.position = frame.position;
            planes_.push_back(std::move(plane));
        }
    }
    /// Of frames that have one position, that of the first, for all.
    std::optional<Vector> implied(const DicomFile& file, std::int64_t k, const DicomFrame& frame) {
        const Vector base = frame.position.value_or(Vector{0, 0, 0}), normal = normal_of(frame);
        const auto at = static_cast<std::size_t>(k);
        if (!frame.position) lies_nowhere_ = true;
        if (!file.grid_offsets.empty()) {
            const std::vector<double>& offsets = file.grid_offsets;
            if (offsets.size() != static_cast<std::size_t>(file.frames))
                refuse(file.path,
                       fmt::format("GridFrameOffsetVector (3004,000c) has {} entries, expected {}",
                                   offsets.size(), file.frames));
            // C.8.8.3.2: relative to the first plane, or positions along z in the patient.
            const bool absolute = offsets[0] != 0 && std::abs(offsets[0] - base[2]) < kSamePlace;
            if (!absolute) return moved(base, offsets[at] - offsets[0], normal);
            return Vector{base[0], base[1], offsets[at]};
        }
        if (files_.size() > 1 && !frame.position)
            refuse(header_.file,
                   fmt::format("'{}' holds {} frames without positions beside other files of its "
                               "series: files of several frames are read one by one",
                               name_of_file(file), file.frames));
        if (file.frames_are_times && file.slice_vector.empty()) return base;
        double slice = static_cast<double>(k);
        if (file.slice_vector.size() == static_cast<std::size_t>(file.frames))
            slice = file.slice_vector[at] - 1;
        return moved(base, slice * step_of(frame), normal);
    }

    /// Slices as tiles of one picture, as Siemens writes functional series.
    void add_mosaics(std::size_t index) {
        const DicomFile& file = files_[index];
        if (file.tiles < 1)
            refuse(file.path,
                   "is a mosaic of slices (ImageType (0008,0008)) that does not say how "
                   "many it holds, (0019,100a)");
        std::int64_t side = 1;
        while (side * side < file.tiles) ++side;
        if (file.columns % side != 0 || file.rows % side != 0)
            refuse(file.path, fmt::format("is a mosaic of {} slices, but its {} x {} pixels do not "
                                          "divide into {} x {} tiles",
                                          file.tiles, file.columns, file.rows, side, side));
        stack_.columns = file.columns / side;
        stack_.rows = file.rows / side;
        is_volume_ = true;
        for (std::int64_t k = 0; k < file.frames; ++k) {
            const DicomFrame frame = file.frame(k);
            const auto spacing = frame.spacing.value_or(std::array<double, 2>{1, 1});
            double step = file.tiles > 1 ? step_of(frame) : 1;
            if (file.tiles_normal && dot(*file.tiles_normal, normal_of(frame)) < 0) step = -step;
            if (!frame.position) lies_nowhere_ = true;
            // The position is that of a single slice of the mosaic's size about the same centre.
            Vector corner = frame.position.value_or(Vector{0, 0, 0});
            corner = moved(corner, double(file.columns - stack_.columns) / 2 * spacing[1],
                           row_of(frame));
            corner =
                moved(corner, double(file.rows - stack_.rows) / 2 * spacing[0], column_of(frame));
            for (std::int64_t tile = 0; tile < file.tiles; ++tile) {
                Plane plane = plane_of(index, k, frame);
                DicomPiece& piece = plane.pieces[0];
                piece.from_x = tile % side * stack_.columns;
                piece.from_y = tile / side * stack_.rows;
                piece.columns = stack_.columns;
                piece.rows = stack_.rows;
                plane.position = moved(corner, double(tile) * step, normal_of(frame));
                planes_.push_back(std::move(plane));
            }
        }
    }

    /// A picture of a slide, cut into frames.
    void add_tiles(std::size_t index) {
        const DicomFile& file = files_[index];
        const std::int64_t across = (file.total_columns + file.columns - 1) / file.columns;
        const std::int64_t down = (file.total_rows + file.rows - 1) / file.rows;
        if (files_.size() > 1)
            refuse(header_.file, "holds pictures in tiles (slides): name one of its files");
        if (file.frames > across * down)
            refuse(file.path,
                   fmt::format("{} tiles make {} x {} pixels, but it holds {} frames: "
                               "several focal planes or colours are not supported",
                               across * down, file.total_columns, file.total_rows, file.frames));
        stack_.columns = file.total_columns;
        stack_.rows = file.total_rows;
        lies_nowhere_ = true;
        is_image_ = true;
        Plane plane;
        plane.position = {0, 0, 0};
        for (std::int64_t k = 0; k < file.frames; ++k) {
            const DicomFrame frame = file.frame(k);
            DicomPiece piece = plane_of(index, k, frame).pieces[0];
            piece.segment = 0;
            piece.to_x = k % across * file.columns;
            piece.to_y = k / across * file.rows;
            if (frame.tile) {
                piece.to_x = static_cast<std::int64_t>((*frame.tile)[0]) - 1;
                piece.to_y = static_cast<std::int64_t>((*frame.tile)[1]) - 1;
            }
            if (piece.to_x < 0 || piece.to_y < 0 || piece.to_x >= stack_.columns ||
                piece.to_y >= stack_.rows)
                refuse(file.path, fmt::format("tile {} lies outside of the whole picture", k));
            piece.columns = std::min(piece.columns, stack_.columns - piece.to_x);
            piece.rows = std::min(piece.rows, stack_.rows - piece.to_y);
            plane.pieces.push_back(piece);
        }
        if (file.frames < across * down)
            warn(fmt::format("{} of {} tiles are missing and stay 0", across * down - file.frames,
                             across * down));
        planes_.push_back(std::move(plane));
    }

    /// Where nothing has a position, the numbers of the pictures order them.
    void place_all() {
        if (stack_.columns == 0) {
            stack_.columns = files_[0].columns;
            stack_.rows = files_[0].rows;
        }
        const auto lost = static_cast<std::size_t>(std::count_if(
            planes_.begin(), planes_.end(), [](const Plane& plane) { return !plane.position; }));
        if (lost > 0) {
            lies_nowhere_ = true;
            if (lost < planes_.size()) {
                const auto found = std::find_if(planes_.begin(), planes_.end(),
                                                [](const Plane& p) { return !p.position; });
                refuse(files_[found->pieces[0].file].path,
                       "ImagePositionPatient (0020,0032) is missing, other slices have it");
            }
            std::stable_sort(planes_.begin(), planes_.end(), [](const Plane& a, const Plane& b) {
                return std::tie(a.instance, a.dimensions) < std::tie(b.instance, b.dimensions);
            });
            const double step = planes_.size() > 1 ? std::abs(step_of(first_)) : 1;
            for (std::size_t i = 0; i < planes_.size(); ++i)
                planes_[i].position = moved({0, 0, 0}, double(i) * step, normal_of(first_));
            if (planes_.size() > 1)
                warn(
                    "no positions (0020,0032); slices are in the order of InstanceNumber "
                    "(0020,0013)");
        }
        if (!guessed_.empty()) warn(guessed_);
    }

    double same_place() const {
        if (!first_.spacing) return kSamePlace;
        return std::min(kSamePlace,
                        kOfPixel * std::min((*first_.spacing)[0], (*first_.spacing)[1]));
    }

    void find_places() {
        const Vector normal = normal_of(first_);
        for (Plane& plane : planes_) plane.place = dot(*plane.position, normal);
        std::stable_sort(planes_.begin(), planes_.end(),
                         [](const Plane& a, const Plane& b) { return a.place < b.place; });
        const double same = 2 * same_place();
        for (std::size_t i = 0; i < planes_.size(); ++i) {
            const bool next = i > 0 && planes_[i].place - planes_[i - 1].place > same;
            if (i == 0 || next) starts_.push_back(i);
            planes_[i].cluster = starts_.size() - 1;
        }
        stack_.slices = static_cast<std::int64_t>(starts_.size());
    }
    std::size_t count_at(std::size_t cluster) const {
        return (cluster + 1 < starts_.size() ? starts_[cluster + 1] : planes_.size()) -
               starts_[cluster];
    }

    /// Planes at one place, equally many everywhere, are times.
    void make_times() {
        // Some writers give a time's number to a few slices only.
        bool temporal = std::all_of(planes_.begin(), planes_.end(),
                                    [](const Plane& plane) { return plane.temporal > 0; });
        if (!temporal)
            for (Plane& plane : planes_) plane.temporal = 0;
        const std::size_t places = starts_.size();
        std::size_t least = planes_.size(), most = 0;
        for (std::size_t i = 0; i < places; ++i) {
            least = std::min(least, count_at(i));
            most = std::max(most, count_at(i));
        }
        // A scanner counts its times, where it does not number them, as acquisitions.
        if (!temporal && least != most && acquisitions_are_times()) {
            for (Plane& plane : planes_) plane.temporal = acquisition_of(plane);
            temporal = true;
        }
        std::vector<Plane> left;
        if (least == most)
            left = planes_;
        else if (temporal)
            left = whole_times();
        else
            left = before_the_stop(least, most);
        std::stable_sort(left.begin(), left.end(), [](const Plane& a, const Plane& b) {
            return a.cluster != b.cluster ? a.cluster < b.cluster : a.order() < b.order();
        });
        stack_.times = static_cast<std::int64_t>(left.size() / places);
        planes_ = std::move(left);
        for (std::size_t i = 0; i < places; ++i)
            starts_[i] = i * static_cast<std::size_t>(stack_.times);
        for (const Plane& plane : planes_) stack_.planes.push_back(plane.pieces);
    }
    std::int64_t acquisition_of(const Plane& plane) const {
        return files_[plane.pieces[0].file].acquisition;
    }
    /// Whether each has every slice at most once, and one has all.
    bool acquisitions_are_times() const {
        std::map<std::int64_t, std::set<std::size_t>> places;
        bool whole = false;
        for (const Plane& plane : planes_) {
            std::set<std::size_t>& of = places[acquisition_of(plane)];
            if (acquisition_of(plane) < 1 || !of.insert(plane.cluster).second) return false;
            whole |= of.size() == starts_.size();
        }
        return whole && places.size() > 1;
    }
    /// Of numbered times those that have every slice, once.
    std::vector<Plane> whole_times() {
        std::vector<Plane> left;
        std::set<std::int64_t> numbers;
        for (const Plane& plane : planes_) numbers.insert(plane.temporal);
        std::string lacking;
        for (const std::int64_t number : numbers) {
            std::vector<Plane> of;
            for (const Plane& plane : planes_)
                if (plane.temporal == number) of.push_back(plane);
            std::set<std::size_t> places;
            for (const Plane& plane : of) places.insert(plane.cluster);
            if (places.size() < of.size()) same_place_twice();
            if (of.size() == starts_.size())
                left.insert(left.end(), of.begin(), of.end());
            else
                lacking +=
                    fmt::format("{}time point {} has {} of {} slices", lacking.empty() ? "" : ", ",
                                number, of.size(), starts_.size());
        }
        if (left.empty()) refuse(header_.file, "no time point is whole: " + lacking);
        warn(lacking + ": left out");
        return left;
    }
    /// A dynamic scan that was stopped: the slices of whole times, in one order, then a part of it.
    std::vector<Plane> before_the_stop(std::size_t least, std::size_t most) {
        std::vector<Plane> taken = planes_;
        std::stable_sort(taken.begin(), taken.end(), [](const Plane& a, const Plane& b) {
            const DicomPiece &p = a.pieces[0], &q = b.pieces[0];
            return std::tie(a.instance, a.acquired, p.file, p.frame) <
                   std::tie(b.instance, b.acquired, q.file, q.frame);
        });
        const std::size_t places = starts_.size(), whole = least * places;
        bool periodic = most == least + 1, by_place = periodic && least > 1;
        std::set<std::size_t> once;
        for (std::size_t i = 0; i < taken.size(); ++i) {
            // Files without numbers of their own have no order to go by.
            if (i > 0 && taken[i].instance == taken[i - 1].instance &&
                taken[i].pieces[0].file != taken[i - 1].pieces[0].file)
                periodic = by_place = false;
            if (i < places) periodic = periodic && once.insert(taken[i].cluster).second;
            if (i >= places) periodic = periodic && taken[i].cluster == taken[i - places].cluster;
            // Numbered place after place: the first ones have the time that was not ended.
            const std::size_t longer = (taken.size() - whole) * most;
            const std::size_t first = i < longer ? i - i % most : i - (i - longer) % least;
            by_place = by_place && taken[i].cluster == taken[first].cluster;
        }
        if (!periodic && !by_place) same_place_twice();
        warn(fmt::format("time point {} has {} of {} slices (a scan that was stopped): left out",
                         least, taken.size() - whole, places));
        if (periodic) {
            taken.resize(whole);
            return taken;
        }
        std::vector<Plane> left;
        for (std::size_t i = 0; i < taken.size(); ++i) {
            const std::size_t longer = (taken.size() - whole) * most;
            if (i >= longer || i % most < least) left.push_back(taken[i]);
        }
        return left;
    }
    [[noreturn]] void same_place_twice() const {
        for (std::size_t i = 1; i < planes_.size(); ++i)
            if (planes_[i].cluster == planes_[i - 1].cluster)
                refuse(header_.file,
                       fmt::format("slices '{}' and '{}' lie at the same position: spacing 0 "
                                   "between them",
                                   name_of_file(files_[planes_[i - 1].pieces[0].file]),
                                   name_of_file(files_[planes_[i].pieces[0].file])));
        refuse(header_.file, "its slices do not divide into time points");
    }

    /// One picture a segment and place; together they are labels, 0 where there is none.
    void join_segments() {
        stack_.labels = true;
        header_.labels = true;
        std::vector<std::vector<DicomPiece>> joined(starts_.size());
        for (const Plane& plane : planes_)
            for (const DicomPiece& piece : plane.pieces) {
                stack_.most_label = std::max(stack_.most_label, piece.segment);
                joined[plane.cluster].push_back(piece);
                if (piece.segment < 1 || piece.segment > 65535)
                    refuse(files_[piece.file].path,
                           fmt::format("frame {} says no segment (0062,000b)", piece.frame));
            }
        // Places without anything have no frames. The others lie on the grid that the file says.
        double step = std::abs(first_.between.value_or(0));
        std::vector<double> places;
        for (const std::size_t start : starts_) places.push_back(planes_[start].place);
        double least_gap = std::numeric_limits<double>::infinity();
        for (std::size_t i = 1; i < places.size(); ++i)
            least_gap = std::min(least_gap, places[i] - places[i - 1]);
        if (!(step > 0) || step > least_gap * (1 + kUneven)) step = least_gap;
        std::vector<std::size_t> at{0};
        for (std::size_t i = 1; i < places.size(); ++i) {
            const double index = (places[i] - places[0]) / step;
            // Far apart they would be a volume of nothing.
            if (std::abs(index - std::round(index)) > kUneven * 10 || index > 1e5)
                refuse(header_.file,
                       fmt::format("segments lie {} mm apart, which is no multiple of {}",
                                   places[i] - places[0], step));
            at.push_back(static_cast<std::size_t>(std::lround(index)));
        }
        stack_.planes.resize(at.back() + 1);
        for (std::size_t i = 0; i < at.size(); ++i) stack_.planes[at[i]] = std::move(joined[i]);
        stack_.slices = static_cast<std::int64_t>(stack_.planes.size());
        grid_step_ = places.size() > 1 ? step : 0;
    }

    std::vector<double> gaps() const {
        std::vector<double> all;
        for (std::size_t i = 1; i < starts_.size(); ++i)
            all.push_back(planes_[starts_[i]].place - planes_[starts_[i - 1]].place);
        return all;
    }

    /// Places as whole steps from the first, where all of them lie on a grid.
    struct Grid {
        double step = 0;               // [mm]
        std::vector<std::int64_t> at;  // of each place; empty: there is no grid
        double off = 0;                // farthest that a place lies beside it, of the step
        std::int64_t count() const { return at.back() + 1; }
    };
    /// @param step  the distance of most neighbours, about
    Grid grid_of(const std::vector<double>& distances, double step) const {
        Grid grid;
        double sum = 0;
        std::int64_t singles = 0;
        for (const double gap : distances)
            if (std::abs(gap / step - 1) < 0.5) sum += gap, ++singles;
        grid.step = sum / static_cast<double>(singles);
        grid.at.push_back(0);
        for (const double gap : distances) {
            const double steps = std::round(gap / grid.step);
            if (!(steps >= 1)) return {};
            grid.at.push_back(grid.at.back() + static_cast<std::int64_t>(std::min(steps, kFar)));
            if (steps > kFar) return grid;
        }
        const double first = planes_[starts_[0]].place;
        grid.step = (planes_[starts_.back()].place - first) / static_cast<double>(grid.at.back());
        for (std::size_t i = 0; i < grid.at.size(); ++i)
            grid.off = std::max(grid.off, std::abs((planes_[starts_[i]].place - first) / grid.step -
                                                   static_cast<double>(grid.at[i])));
        if (grid.off > std::min(kMostOffGrid, kOffGrid + 2 * half_a_digit(step) / grid.step))
            return {};
        return grid;
    }

    /// Where slices lie on an even grid and some are missing, their places stay, empty: so what
    /// lies behind them stays where it is.
    void keep_missing_places() {
        std::vector<double> sorted = gaps();
        if (sorted.size() < 2) return;
        std::sort(sorted.begin(), sorted.end());
        const double median = sorted[(sorted.size() - 1) / 2];
        if (sorted.back() < 1.5 * median || even_but_for_digits(median)) return;
        Grid grid = grid_of(gaps(), median);
        // Where more than half of the distances are of several steps, the least is one.
        if (grid.at.empty()) {
            grid = grid_of(gaps(), sorted.front());
            if (grid.at.empty() || too_sparse(grid)) return;
        }
        if (too_sparse(grid)) refuse_sparse(grid);
        tell_missing(grid);
        std::vector<std::vector<DicomPiece>> planes(
            static_cast<std::size_t>(grid.count() * stack_.times));
        for (std::size_t i = 0; i < grid.at.size(); ++i)
            for (std::int64_t time = 0; time < stack_.times; ++time)
                planes[static_cast<std::size_t>(grid.at[i] * stack_.times + time)] =
                    stack_.plane(static_cast<std::int64_t>(i), time);
        stack_.planes = std::move(planes);
        stack_.slices = grid.count();
        grid_step_ = grid.step;
    }
    /// At most a third may be missing: with more the places are no grid of this series.
    bool too_sparse(const Grid& grid) const {
        const auto there = static_cast<std::int64_t>(grid.at.size());
        return 3 * (grid.count() - there) > grid.count();
    }
    const Plane& at_place(std::size_t i) const { return planes_[starts_[i]]; }
    [[noreturn]] void refuse_sparse(const Grid& grid) const {
        std::size_t widest = 1;
        for (std::size_t i = 1; i < grid.at.size(); ++i)
            if (grid.at[i] - grid.at[i - 1] > grid.at[widest] - grid.at[widest - 1]) widest = i;
        const auto there = static_cast<std::int64_t>(starts_.size());
        refuse(header_.file,
               fmt::format("slices '{}' and '{}' lie {:.6g} mm apart, others {:.6g}: {} of {} "
                           "slices would be missing, more than a third. Move what belongs "
                           "together into a folder of its own",
                           shown(name_of_file(files_[at_place(widest - 1).pieces[0].file])),
                           shown(name_of_file(files_[at_place(widest).pieces[0].file])),
                           at_place(widest).place - at_place(widest - 1).place, grid.step,
                           grid.count() - there, grid.count()));
    }
    void tell_missing(const Grid& grid) {
        constexpr int kMostNamed = 5;
        std::string places;
        int named = 0;
        for (std::size_t i = 1; i < grid.at.size(); ++i)
            for (std::int64_t k = grid.at[i - 1] + 1; k < grid.at[i]; ++k)
                if (named++ < kMostNamed)
                    places += fmt::format("{}{:.6g}", places.empty() ? "" : ", ",
                                          at_place(0).place + static_cast<double>(k) * grid.step);
        warn(fmt::format(
            "{} of {} slices {} missing, at {}{} mm along the normal of the slices: "
            "{} empty",
            named, grid.count(), named > 1 ? "are" : "is", places, named > kMostNamed ? " ..." : "",
            named > 1 ? "their places stay" : "its place stays"));
        if (grid.off > kUneven && grid.off * grid.step > 2 * half_a_digit(grid.step))
            warn(fmt::format("slices lie up to {:.3g} mm beside an even grid of {:.6g} mm",
                             grid.off * grid.step, grid.step));
    }

    /// How far along the normal a place may lie beside where it is written, as numbers are rounded
    /// to the digits that they are written with [mm]. A writer that leaves out zeros at the end
    /// shows all its digits in some of the numbers.
    /// @param step  of the slices: digits that are no small part of it are taken as they are
    /// written,
    ///              as 0, 1 and 3 mm rather miss a slice than lie 1.5 mm apart
    double half_a_digit(double step) const {
        const Vector normal = normal_of(first_), all = digits(step);
        double half = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            half += 0.5 * std::abs(normal[axis]) * all[axis];
        return half;
    }
    /// How far rounding may move one place from another [mm].
    double digit_length(double step) const { return length(digits(step)); }
    /// The last digit of positions along each axis [mm].
    Vector digits(double step) const {
        constexpr double kSmallPart = 0.25;
        if (!files_[0].grid_offsets.empty()) return {0, 0, 0};  // other numbers say where they are
        std::array<int, 3> decimals;
        decimals.fill(std::numeric_limits<int>::min());
        for (const std::size_t start : starts_) {
            const DicomPiece& piece = planes_[start].pieces[0];
            const DicomFrame frame = files_[piece.file].frame(piece.frame);
            for (std::size_t axis = 0; axis < 3; ++axis)
                decimals[axis] = std::max(decimals[axis], frame.decimals[axis]);
        }
        Vector last;
        for (std::size_t axis = 0; axis < 3; ++axis) last[axis] = std::pow(10.0, -decimals[axis]);
        const Vector normal = normal_of(first_);
        double along = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) along += std::abs(normal[axis]) * last[axis];
        return along <= kSmallPart * step ? last : Vector{0, 0, 0};
    }
    /// The step of the even grid that all places lie on but for the digits that they are written
    /// with. That of places i and j is their distance give or take a digit, over j - i; some grid
    /// has them all where all pairs leave a step in common.
    std::optional<double> even_but_for_digits(double step) const {
        constexpr double kRounding = 1e-9;      // of the places themselves, in f64
        constexpr std::size_t kMost = 1 << 13;  // pairs of more take long
        if (starts_.size() > kMost) return std::nullopt;
        const double digit = 2 * half_a_digit(step) * (1 + kRounding);
        double low = 0, high = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < starts_.size(); ++i)
            for (std::size_t j = i + 1; j < starts_.size(); ++j) {
                const double apart = at_place(j).place - at_place(i).place;
                const auto between = static_cast<double>(j - i);
                low = std::max(low, (apart - digit) / between);
                high = std::min(high, (apart + digit) / between);
            }
        const double from_ends = (at_place(starts_.size() - 1).place - at_place(0).place) /
                                 static_cast<double>(starts_.size() - 1);
        if (!(low <= high * (1 + kRounding))) return std::nullopt;
        return std::clamp(from_ends, low, std::max(low, high));
    }

    /// The median distance.
    double distance() {
        if (grid_step_ > 0) return grid_step_;
        std::vector<double> sorted = gaps();
        std::sort(sorted.begin(), sorted.end());
        const double median = sorted[(sorted.size() - 1) / 2];
        if (sorted.back() - sorted.front() <= kUneven * median) return median;
        if (const auto even = even_but_for_digits(median)) return *even;
        double off = 0;
        for (std::size_t i = 0; i < starts_.size(); ++i)
            off = std::max(off, std::abs(at_place(i).place - at_place(0).place -
                                         static_cast<double>(i) * median));
        warn(
            fmt::format("slices lie unevenly, {:.6g} to {:.6g} mm apart; taken as {:.6g}, which "
                        "moves them by up to {:.3g} mm",
                        sorted.front(), sorted.back(), median, off));
        return median;
    }

    void take_geometry() {
        header_.volume = !is_image_ && (folder_ || is_volume_ || stack_.slices > 1 ||
                                        (files_[0].frames > 1 && !files_[0].frames_are_times));
        auto spacing = first_.spacing;
        header_.unit = spacing ? "mm" : "";
        if (!spacing && files_[0].detector_spacing) {
            spacing = files_[0].detector_spacing;
            header_.unit = "mm";
            warn(
                "pixel spacing taken at the detector (0018,1164): what lies nearer to the source "
                "is magnified");
        }
        if (!spacing) spacing = files_[0].aspect;
        const auto [down, across] = spacing.value_or(std::array<double, 2>{1, 1});
        header_.modality = files_[0].modality;
        header_.value_unit = value_unit_of(files_[0]);
        header_.anatomical = !lies_nowhere_ && first_.orientation.has_value();
        header_.origin = *planes_[0].position;
        double step = std::abs(first_.between.value_or(0));
        if (!(step > 0)) step = std::abs(first_.thickness.value_or(0));
        if (!(step > 0)) {
            step = 1;
            if (header_.volume && starts_.size() == 1)
                warn("nothing says how thick its one slice is; taken as 1");
        }
        Vector z = normal_of(first_);
        if (starts_.size() > 1) {
            step = distance();
            lean(z, step, std::min(down, across));
        }
        const Vector lengths{across, down, step};
        take_steps(header_, {row_of(first_), column_of(first_), z},
                   "ImageOrientationPatient (0020,0037)");
        header_.spacing = lengths;
        check_spacing(header_, "PixelSpacing (0028,0030)");
    }
    /// Slices may follow each other along another line than their normal: a tilted gantry.
    void lean(Vector& z, double& step, double pixel) {
        const Plane &first = planes_[starts_[0]], &last = planes_[starts_.back()];
        Vector along;
        for (int axis = 0; axis < 3; ++axis)
            along[axis] = (*last.position)[axis] - (*first.position)[axis];
        const double size = length(along);
        for (double& entry : along) entry /= size;
        double aside = 0;
        for (const std::size_t start : starts_) {
            Vector off;
            for (int axis = 0; axis < 3; ++axis)
                off[axis] = (*planes_[start].position)[axis] - (*first.position)[axis];
            const double way = (planes_[start].place - first.place) / dot(along, z);
            aside = std::max(aside, length(moved(off, -way, along)));
        }
        if (aside > kFarAside * pixel)
            refuse(
                header_.file,
                fmt::format("slices do not follow one line: one lies {:.3g} mm beside it", aside));
        if (aside > kAside * pixel)
            warn(fmt::format("slices do not follow one line: up to {:.3g} mm beside it", aside));
        const double tilt = length(cross(along, z));
        if (tilt <= kTilt || tilt * size <= digit_length(step)) return;
        warn("the stack leans against its slices (tilted gantry)");
        step /= dot(along, z);
        z = along;
    }

    const std::vector<DicomFile>& files_;
    bool folder_;
    Header& header_;
    DicomFrame first_;
    DicomStack stack_;
    std::vector<Plane> planes_;
    std::vector<std::size_t> starts_;  // of the planes at each place
    bool lies_nowhere_ = false;        // some position is missing
    bool is_image_ = false, is_volume_ = false;
    std::string guessed_;
    double grid_step_ = 0;  // where slices are missing
};

}  // namespace

DicomStack stack_of(const std::vector<DicomFile>& files, bool folder, Header& header) {
    return Builder(files, folder, header).build();
}

}  // namespace edgewise::store
