// NRRD 1 to 5 (teem.sourceforge.net/nrrd/format.html): attached, detached, lists of data files.

#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <map>

#include "io/data_list.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::int64_t kMostAxes = 16;  // NRRD_DIM_MAX

struct TypeName {
    std::string_view name;
    Type type;
    Wide wide = Wide::no;
};
constexpr TypeName kTypes[] = {{"signed char", Type::i8},
                               {"int8", Type::i8},
                               {"int8_t", Type::i8},
                               {"char", Type::i8},
                               {"uchar", Type::u8},
                               {"unsigned char", Type::u8},
                               {"uint8", Type::u8},
                               {"uint8_t", Type::u8},
                               {"short", Type::i16},
                               {"short int", Type::i16},
                               {"signed short", Type::i16},
                               {"signed short int", Type::i16},
                               {"int16", Type::i16},
                               {"int16_t", Type::i16},
                               {"ushort", Type::u16},
                               {"unsigned short", Type::u16},
                               {"unsigned short int", Type::u16},
                               {"uint16", Type::u16},
                               {"uint16_t", Type::u16},
                               {"int", Type::i32},
                               {"signed int", Type::i32},
                               {"int32", Type::i32},
                               {"int32_t", Type::i32},
                               {"uint", Type::u32},
                               {"unsigned int", Type::u32},
                               {"uint32", Type::u32},
                               {"uint32_t", Type::u32},
                               {"longlong", Type::f64, Wide::with_sign},
                               {"long long", Type::f64, Wide::with_sign},
                               {"long long int", Type::f64, Wide::with_sign},
                               {"signed long long", Type::f64, Wide::with_sign},
                               {"signed long long int", Type::f64, Wide::with_sign},
                               {"int64", Type::f64, Wide::with_sign},
                               {"int64_t", Type::f64, Wide::with_sign},
                               {"ulonglong", Type::f64, Wide::without_sign},
                               {"unsigned long long", Type::f64, Wide::without_sign},
                               {"unsigned long long int", Type::f64, Wide::without_sign},
                               {"uint64", Type::f64, Wide::without_sign},
                               {"uint64_t", Type::f64, Wide::without_sign},
                               {"float", Type::f32},
                               {"double", Type::f64}};

class Nrrd {
 public:
    explicit Nrrd(const std::string& path) : path_(path), file_(path) {
        header_.file = path;
        header_.format = "NRRD";
    }

    Header run() {
        fields();
        sample_type();
        axes();
        geometry();
        data();
        take_axes(header_, stored_);
        header_.volume = spatial_ == 3;
        for (auto& [number, of] : segments_) {
            // Layers of a file that has one are no channels.
            if (header_.channels == 1) of.channel.reset();
            header_.segments.push_back(std::move(of));
        }
        check_skip();
        take_reader(header_, std::move(stored_));
        return std::move(header_);
    }

 private:
    void fields() {
        text_ = header_text(file_);
        if (text_.lines.empty() || !text_.lines[0].starts_with("NRRD000"))
            refuse(path_, "not NRRD: the first line is not 'NRRD000N'");
        for (std::size_t i = 1; i < text_.lines.size(); ++i) {
            const std::string_view line = text_.lines[i];
            if (line.starts_with('#')) continue;
            const auto colon = line.find(':');
            if (colon == line.npos) {
                if (fields_.contains("data file")) continue;  // a name of its LIST
                refuse(path_, fmt::format("line {}: '{}' is no field", i + 1, shown(line)));
            }
            if (line.substr(colon).starts_with(":=")) {
                if (line.starts_with("Segment"))
                    segment(line.substr(7, colon - 7), trim(line.substr(colon + 2)));
                continue;
            }
            std::string name = lower(trim(line.substr(0, colon)));
            if (name == "datafile") name = "data file";
            const std::string value(trim(line.substr(colon + 1)));
            fields_[name == "centerings" ? "centers" : name] = value;
            if (name == "data file" && value.starts_with("LIST")) {
                list_begin_ = i + 1;
                break;
            }
        }
        if (!text_.terminated && !fields_.contains("data file"))
            refuse(path_, "the header has no empty line at its end");
    }
    /// 3D Slicer's segmentations: Segment0_LabelValue, Segment0_Name, Segment0_Color ...
    void segment(std::string_view key, std::string_view text) {
        const auto end = key.find('_');
        const auto number = end == key.npos ? std::nullopt : to_integer(key.substr(0, end));
        if (!number || *number < 0) return;
        header_.labels = true;
        Segment& of = segments_.try_emplace(*number, Segment{1, "", {}, {}}).first->second;
        const std::string_view what = key.substr(end + 1);
        if (what == "Name") of.name = text;
        if (what == "LabelValue") of.label = to_integer(text).value_or(of.label);
        if (what == "Layer")
            if (const auto layer = to_integer(text); layer && *layer >= 0 && *layer < (1 << 20))
                of.channel = static_cast<int>(*layer);
        if (what != "Color") return;
        const auto parts = words(text);
        std::array<double, 3> color{};
        for (std::size_t i = 0; i < 3; ++i) {
            const auto part = i < parts.size() ? to_double(parts[i]) : std::nullopt;
            if (!part || !(*part >= 0 && *part <= 1)) return;
            color[i] = *part;
        }
        of.color = color;
    }
    const std::string& need(const std::string& name) const {
        const auto found = fields_.find(name);
        if (found == fields_.end()) refuse(path_, "field '" + name + "' is missing");
        return found->second;
    }
    std::string value(const std::string& name) const {
        const auto found = fields_.find(name);
        return found == fields_.end() ? "" : found->second;
    }
    std::int64_t count(const std::string& name, std::int64_t otherwise) const {
        if (value(name).empty()) return otherwise;
        const auto numbers = integers(path_, name, value(name));
        if (numbers.size() != 1) refuse(path_, "field '" + name + "' is not one number");
        return numbers[0];
    }

    void sample_type() {
        const std::string type = lower(need("type"));
        std::string name;  // blanks between the words may be any
        for (std::string_view word : words(type)) (name += name.empty() ? "" : " ") += word;
        for (const TypeName& row : kTypes)
            if (row.name == name) {
                stored_.type = row.type;
                stored_.wide = row.wide;
                return;
            }
        refuse(path_, "field 'type' is '" + shown(name) + "': unknown or not supported");
    }

    void axes() {
        dimension_ = count("dimension", -1);
        if (dimension_ < 1 || dimension_ > kMostAxes)
            refuse(path_,
                   "field 'dimension' is '" + shown(need("dimension")) + "', expected 1 to 16");
        sizes_ = integers(path_, "sizes", need("sizes"));
        if (static_cast<std::int64_t>(sizes_.size()) != dimension_)
            refuse(path_, fmt::format("field 'sizes' has {} entries, field 'dimension' says {}",
                                      sizes_.size(), dimension_));
        directions();
        const std::string kinds_text = value("kinds");
        const auto kinds = words(kinds_text);
        if (!kinds.empty() && static_cast<std::int64_t>(kinds.size()) != dimension_)
            refuse(path_, fmt::format("field 'kinds' has {} entries, expected {}", kinds.size(),
                                      dimension_));
        for (std::int64_t i = 0; i < dimension_; ++i) {
            const auto index = static_cast<std::size_t>(i);
            const std::string kind = kinds.empty() ? "???" : lower(kinds[index]);
            const Axis::Kind what = kind_of(kind, index);
            if (what <= Axis::z) space_axis_.push_back(index);
            for (const Axis& other : stored_.axes)
                if (other.kind == what && other.size > 1 && sizes_[index] > 1)
                    refuse(path_, fmt::format("{} axes: more than three of space, one of time and "
                                              "one of channels are not supported",
                                              dimension_));
            stored_.axes.push_back({what, sizes_[index]});
            header_.colour |= (kind == "rgb-color" && sizes_[index] == 3) ||
                              (kind == "rgba-color" && sizes_[index] == 4);
            if (kind == "rgba-color") header_.alpha = Alpha::straight;
            if (kind == "complex" && sizes_[index] > 1)
                refuse(path_, "field 'kinds' says complex: complex samples are not supported");
        }
        if (spatial_ < 1) refuse(path_, "has no axis of space");
    }
    Axis::Kind kind_of(const std::string& kind, std::size_t index) {
        const bool unknown = kind == "???" || kind == "none";
        bool space = kind == "domain" || kind == "space" || (unknown && spatial_ < 3);
        if (unknown && !directions_.empty()) space = directions_[index].has_value();
        if (space && spatial_ < 3) return static_cast<Axis::Kind>(spatial_++);
        if (kind == "time" || space || (unknown && index == 3)) return Axis::time;
        return Axis::channel;
    }

    void directions() {
        if (value("space directions").empty()) return;
        space_dimension();
        std::string_view rest = fields_["space directions"];
        while (!(rest = trim(rest)).empty()) {
            if (rest.starts_with("none")) {
                directions_.emplace_back();
                rest.remove_prefix(4);
                continue;
            }
            const auto end = rest.find(')');
            // Some write "none" as a vector of NaN.
            if (end != rest.npos && lower(rest.substr(0, end)).find("nan") != rest.npos) {
                directions_.emplace_back();
                rest.remove_prefix(end + 1);
                continue;
            }
            if (!rest.starts_with('(') || end == rest.npos)
                refuse(path_, "field 'space directions': '" + shown(rest) + "' is no vector");
            directions_.push_back(vector(rest.substr(0, end + 1), "space directions"));
            rest.remove_prefix(end + 1);
        }
        if (static_cast<std::int64_t>(directions_.size()) != dimension_)
            refuse(path_, fmt::format("field 'space directions' has {} entries, expected {}",
                                      directions_.size(), dimension_));
    }
    Vector vector(std::string_view text, const std::string& field) const {
        text = trim(text);
        if (!text.starts_with('(') || !text.ends_with(')'))
            refuse(path_, "field '" + field + "': '" + shown(text) + "' is no vector");
        Vector result{0, 0, 0};
        const auto parts = split(text.substr(1, text.size() - 2), ',');
        for (std::size_t i = 0; i < parts.size() && i < 3; ++i) {
            const auto entry = to_double(parts[i]);
            if (!entry)
                refuse(path_, "field '" + field + "': '" + shown(parts[i]) + "' is no number");
            result[i] = *entry;
        }
        if (parts.size() != space_dimension_ && !(parts.size() == 4 && space_dimension_ == 4))
            refuse(path_, fmt::format("field '{}': a vector of {} entries, expected {}", field,
                                      parts.size(), space_dimension_));
        return result;
    }
    void space_dimension() {
        const std::string space = lower(value("space"));
        space_dimension_ = static_cast<std::size_t>(count("space dimension", 3));
        if (space.ends_with("-time") || space == "rast" || space == "last" || space == "lpst")
            space_dimension_ = 4;
        if (space_dimension_ < 2 || space_dimension_ > 4)
            refuse(path_, "field 'space dimension' is '" + shown(value("space dimension")) +
                              "', expected 2 to 4");
    }

    void geometry() {
        const std::string space = lower(value("space"));
        const bool ras =
            space.starts_with("right-anterior-superior") || space == "ras" || space == "rast";
        const bool las =
            space.starts_with("left-anterior-superior") || space == "las" || space == "last";
        const bool lps =
            space.starts_with("left-posterior-superior") || space == "lps" || space == "lpst";
        header_.anatomical = (ras || las || lps) && !directions_.empty();
        for (const char* field : {"sample units", "sampleunits"})
            if (header_.value_unit.empty()) header_.value_unit = unit_of_values(value(field));
        if (directions_.empty())
            spacings();
        else
            steps();
        if (header_.anatomical && ras) flip_xy(header_);
        if (header_.anatomical && las) {
            header_.origin[1] = 0 - header_.origin[1];
            for (Vector& column : header_.direction) column[1] = 0 - column[1];
        }
    }
    void spacings() {
        if (!(value("spacings").empty() ? from_bounds() : from_spacings())) return;
        check_spacing(header_, "spacings");
        // Each axis has a unit of its own; that of colours is empty.
        const Vector factors = factors_of("units", [&](std::size_t i) { return space_axis_[i]; });
        for (std::size_t i = 0; i < 3; ++i) header_.spacing[i] *= factors[i];
    }
    bool from_spacings() {
        const auto steps = doubles(path_, "spacings", value("spacings"));
        if (static_cast<std::int64_t>(steps.size()) != dimension_)
            refuse(path_, fmt::format("field 'spacings' has {} entries, expected {}", steps.size(),
                                      dimension_));
        for (std::size_t i = 0; i < space_axis_.size(); ++i) {
            header_.spacing[i] = std::abs(steps[space_axis_[i]]);
            if (!std::isnan(header_.spacing[i])) continue;
            // NaN is how NRRD writes a spacing that is not known.
            header_.warnings.push_back(fmt::format(
                "{}: field 'spacings' does not know axis {}; taken as 1", path_, space_axis_[i]));
            header_.spacing[i] = 1;
        }
        return true;
    }
    /// Without spacings the ends of an axis say it: of its cells, or of its samples.
    bool from_bounds() {
        if (value("axis mins").empty() || value("axis maxs").empty()) return false;
        const auto low = doubles(path_, "axis mins", value("axis mins"));
        const auto high = doubles(path_, "axis maxs", value("axis maxs"));
        const std::string centers_text = lower(value("centers"));
        const auto centers = words(centers_text);
        if (low.size() != sizes_.size() || high.size() != sizes_.size())
            refuse(path_, fmt::format("fields 'axis mins' and 'axis maxs' have {} and {} entries, "
                                      "expected {}",
                                      low.size(), high.size(), sizes_.size()));
        for (std::size_t i = 0; i < space_axis_.size(); ++i) {
            const std::size_t axis = space_axis_[i];
            const bool nodes = axis < centers.size() && centers[axis] == "node";
            const std::int64_t parts = sizes_[axis] - (nodes && sizes_[axis] > 1);
            const double step = (high[axis] - low[axis]) / static_cast<double>(parts);
            if (std::isfinite(step) && step != 0) header_.spacing[i] = std::abs(step);
        }
        return true;
    }
    void steps() {
        std::array<Vector, 3> columns{Vector{1, 0, 0}, Vector{0, 1, 0}, Vector{0, 0, 1}};
        for (std::size_t i = 0; i < space_axis_.size(); ++i)
            if (const auto& step = directions_[space_axis_[i]]) columns[i] = *step;
        if (spatial_ == 2) columns[2] = cross(columns[0], columns[1]);
        if (spatial_ == 2) normalise(columns[2]);
        // Units are those of space, not of the axes that run through it.
        const Vector factors = factors_of("space units", [](std::size_t i) { return i; });
        for (Vector& column : columns)
            for (std::size_t i = 0; i < 3; ++i) column[i] *= factors[i];
        take_steps(header_, columns, "space directions");
        if (!value("space origin").empty())
            header_.origin = vector(value("space origin"), "space origin");
        for (std::size_t i = 0; i < 3; ++i) header_.origin[i] *= factors[i];
        check_spacing(header_, "space origin");
    }
    static void normalise(Vector& v) {
        const double size = length(v);
        for (double& entry : v) entry /= size;
    }
    /// Entries between quotes.
    std::vector<std::string> quoted(const std::string& field) const {
        const std::string text = value(field);
        std::vector<std::string> entries;
        for (std::size_t at = text.find('"'); at != text.npos; at = text.find('"', at)) {
            const auto end = text.find('"', at + 1);
            if (end == text.npos)
                refuse(path_, "field '" + field + "': a quotation mark is missing");
            entries.push_back(text.substr(at + 1, end - at - 1));
            at = end + 1;
        }
        // Not as the format wants it, but found: words without quotes.
        if (entries.empty())
            for (std::string_view word : words(text)) entries.emplace_back(word);
        return entries;
    }
    /// Millimetres a unit along x, y and z; sets the header's unit.
    /// @param entry  which entry of the field belongs to one of them
    template <class F>
    Vector factors_of(const std::string& field, F entry) {
        // A patient's space is in millimetres where the file says nothing.
        if (header_.anatomical) header_.unit = "mm";
        const auto units = quoted(field);
        Vector factors{1, 1, 1};
        if (units.empty()) return factors;
        const std::size_t axes = std::min<std::size_t>(static_cast<std::size_t>(spatial_), 3);
        std::size_t known = 0;
        for (std::size_t i = 0; i < axes; ++i) {
            const std::string unit = entry(i) < units.size() ? units[entry(i)] : "";
            factors[i] = millimetres(unit);
            known += factors[i] > 0;
            if (factors[i] > 0) continue;
            factors[i] = 1;
            if (unit.empty() || unit == "???" || unit == "pixel" || unit == "voxel") continue;
            header_.unit.clear();
            header_.warnings.push_back(message(
                "{}: field '{}' holds {}, which is no unit of length; @input_unit says which it is",
                path_, field, in_quotes(unit)));
        }
        if (known == 0) return factors;
        if (known < axes) {
            header_.unit.clear();
            header_.warnings.push_back(
                fmt::format("{}: field '{}' says the unit of {} of {} axes of space: lengths are "
                            "kept as they stand, without a unit",
                            path_, field, known, axes));
            return {1, 1, 1};
        }
        for (std::size_t i = axes; i < 3; ++i) factors[i] = factors[0];
        header_.unit = "mm";
        header_.file_unit = factors[0];
        return factors;
    }

    void data() {
        encoding();
        stored_.big_endian = value("endian") == "big";
        if (stored_.width() > 1 && stored_.encoding != Stored::Encoding::text &&
            need("endian") != "little" && need("endian") != "big")
            refuse(path_,
                   "field 'endian' is '" + shown(value("endian")) + "', expected little or big");
        if (!fields_.contains("data file")) {
            stored_.pieces = {{path_, text_.end}};
        } else {
            for (const std::string& name : data_files()) stored_.pieces.push_back({name, 0});
        }
        skip_lines();
        const std::int64_t skip = count("byte skip", 0);
        if (skip < -1) refuse(path_, fmt::format("field 'byte skip' is {}", skip));
        if (skip == -1 && stored_.encoding != Stored::Encoding::raw)
            refuse(path_, "field 'byte skip' is -1, which only raw data allow");
        // Of compressed data the bytes behind decompression are meant.
        const bool compressed = stored_.encoding == Stored::Encoding::gzip ||
                                stored_.encoding == Stored::Encoding::bzip2;
        for (auto& piece : stored_.pieces) {
            if (skip == -1)
                piece.offset = from_end(piece.path);
            else if (!compressed)
                piece.offset += static_cast<std::uint64_t>(skip);
        }
        if (compressed) stored_.skip = static_cast<std::uint64_t>(skip);
    }
    std::uint64_t from_end(const std::string& piece) const {
        std::int64_t bytes = static_cast<std::int64_t>(stored_.width());
        for (std::int64_t size : sizes_) bytes = product(path_, bytes, size);
        bytes /= static_cast<std::int64_t>(stored_.pieces.size());
        const auto size = static_cast<std::int64_t>(File(piece).size());
        if (bytes < 0 || bytes > size)
            refuse(path_, fmt::format("short data: expected {} bytes, found {}", bytes, size));
        return static_cast<std::uint64_t>(size - bytes);
    }
    void encoding() {
        const std::string name = lower(need("encoding"));
        if (name == "raw")
            stored_.encoding = Stored::Encoding::raw;
        else if (name == "gzip" || name == "gz")
            stored_.encoding = Stored::Encoding::gzip;
        else if (name == "bzip2" || name == "bz2")
            stored_.encoding = Stored::Encoding::bzip2;
        else if (name == "hex")
            stored_.encoding = Stored::Encoding::hex;
        else if (name == "text" || name == "txt" || name == "ascii")
            stored_.encoding = Stored::Encoding::text;
        else
            refuse(path_, "field 'encoding' is '" + shown(name) + "': unknown or not supported");
    }
    std::vector<std::string> data_files() const {
        const std::string& text = need("data file");
        std::vector<std::string> files;
        if (list_begin_ > 0) {
            for (std::size_t i = list_begin_; i < text_.lines.size(); ++i)
                if (!trim(text_.lines[i]).empty()) files.push_back(beside(path_, text_.lines[i]));
            return files;
        }
        const auto parts = words(text);
        if (parts.size() < 4 || parts[0].find('%') == std::string_view::npos)
            return {beside(path_, text)};
        const auto first = to_integer(parts[1]), last = to_integer(parts[2]),
                   step = to_integer(parts[3]);
        if (!first || !last || !step)
            refuse(path_, "field 'data file': '" + shown(text) + "' is no numbered list");
        return numbered_files(path_, parts[0], *first, *last, *step);
    }
    void skip_lines() {
        const std::int64_t lines = count("line skip", 0);
        if (lines < 0 || lines > 1000000)
            refuse(path_, fmt::format("field 'line skip' is {}", lines));
        for (auto& piece : stored_.pieces) {
            if (lines == 0) return;
            const File file(piece.path);
            Bytes chunk(1 << 16);
            for (std::int64_t left = lines; left > 0;) {
                const std::size_t got = file.read_some(piece.offset, chunk);
                if (got == 0) refuse(path_, "field 'line skip' leads beyond the end of the data");
                std::size_t i = 0;
                while (i < got && left > 0) left -= chunk[i++] == std::byte{'\n'};
                piece.offset += i;
            }
        }
    }
    void check_skip() const {
        for (const auto& piece : stored_.pieces)
            if (piece.offset > File(piece.path).size())
                refuse(path_, "field 'byte skip' leads beyond the end of the data");
    }

    std::string path_;
    File file_;
    HeaderText text_;
    std::map<std::string, std::string> fields_;
    std::map<std::int64_t, Segment> segments_;  // by their numbers
    std::size_t list_begin_ = 0, space_dimension_ = 3;
    std::int64_t dimension_ = 0;
    int spatial_ = 0;
    std::vector<std::int64_t> sizes_;
    std::vector<std::size_t> space_axis_;  // which NRRD axis is x, y, z
    std::vector<std::optional<Vector>> directions_;
    Header header_;
    Stored stored_;
};

}  // namespace

Header inspect_nrrd(const std::string& path) { return Nrrd(path).run(); }

}  // namespace edgewise::store
