// MetaImage: .mha with its data inside, .mhd beside them (ITK's MetaIO).

#include <cmath>
#include <fmt/format.h>
#include <map>

#include "io/data_list.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

struct TypeName {
    std::string_view name;
    Type type;
    Wide wide = Wide::no;
};
// MetaIO's LONG has four bytes on every machine, LONG_LONG eight.
constexpr TypeName kTypes[] = {{"MET_UCHAR", Type::u8},
                               {"MET_CHAR", Type::i8},
                               {"MET_USHORT", Type::u16},
                               {"MET_SHORT", Type::i16},
                               {"MET_UINT", Type::u32},
                               {"MET_INT", Type::i32},
                               {"MET_ULONG", Type::u32},
                               {"MET_LONG", Type::i32},
                               {"MET_ULONG_LONG", Type::f64, Wide::without_sign},
                               {"MET_LONG_LONG", Type::f64, Wide::with_sign},
                               {"MET_FLOAT", Type::f32},
                               {"MET_DOUBLE", Type::f64}};

class MetaImage {
 public:
    explicit MetaImage(const std::string& path) : path_(path), file_(path) {
        header_.file = path;
        header_.format = "MetaImage";
    }

    Header run() {
        fields();
        sample_type();
        axes();
        geometry();
        data();
        take_axes(header_, stored_);
        header_.volume = dimensions_ >= 3;
        take_reader(header_, std::move(stored_));
        return std::move(header_);
    }

 private:
    void fields() {
        const Bytes head = file_.head(4096);
        const std::string_view start(reinterpret_cast<const char*>(head.data()), head.size());
        if (start.find("NDims") == start.npos && start.find("ObjectType") == start.npos)
            refuse(path_, "not MetaImage: no field 'NDims' at its start");
        text_ = header_text(file_, "ElementDataFile");
        if (!text_.terminated) refuse(path_, "field 'ElementDataFile' is missing");
        for (const std::string& line : text_.lines) {
            const auto equal = line.find('=');
            if (trim(line).empty()) continue;
            if (equal == line.npos) refuse(path_, in_quotes(line) + " is no field");
            fields_[std::string(trim(line.substr(0, equal)))] = trim(line.substr(equal + 1));
        }
        const std::string object = value("ObjectType", "");
        if (!object.empty() && object != "Image")
            refuse(path_, "field 'ObjectType' is '" + shown(object) + "', expected Image");
    }
    std::string value(const std::string& a, const std::string& b, const std::string& c = "") const {
        for (const std::string& name : {a, b, c})
            if (const auto found = fields_.find(name); found != fields_.end()) return found->second;
        return "";
    }
    const std::string& need(const std::string& name) const {
        const auto found = fields_.find(name);
        if (found == fields_.end()) refuse(path_, "field '" + name + "' is missing");
        return found->second;
    }
    bool truth(const std::string& a, const std::string& b = "") const {
        const std::string text = lower(value(a, b));
        return text.starts_with('t') || text.starts_with('1') || text.starts_with('y');
    }
    std::int64_t one(const std::string& name, std::int64_t otherwise) const {
        if (!fields_.contains(name)) return otherwise;
        const auto numbers = integers(path_, name, need(name));
        if (numbers.size() != 1) refuse(path_, "field '" + name + "' is not one number");
        return numbers[0];
    }
    /// Exactly `count` numbers, or none where the field is absent.
    std::vector<double> some(const std::string& name, std::size_t count) const {
        if (!fields_.contains(name)) return {};
        auto numbers = doubles(path_, name, need(name));
        if (numbers.size() != count)
            refuse(path_, fmt::format("field '{}' has {} entries, expected {}", name,
                                      numbers.size(), count));
        return numbers;
    }
    std::vector<double> first_of(std::initializer_list<const char*> names,
                                 std::size_t count) const {
        for (const char* name : names)
            if (fields_.contains(name)) return some(name, count);
        return {};
    }

    void sample_type() {
        std::string name = need("ElementType");
        if (name.ends_with("_ARRAY")) name.resize(name.size() - 6);
        for (const TypeName& row : kTypes)
            if (row.name == name) {
                stored_.type = row.type;
                stored_.wide = row.wide;
                return;
            }
        refuse(path_, "field 'ElementType' is '" + shown(name) + "': unknown or not supported");
    }
    void axes() {
        const std::int64_t count = one("NDims", 0);
        const auto sizes = integers(path_, "DimSize", need("DimSize"));
        if (count < 1 || static_cast<std::int64_t>(sizes.size()) != count)
            refuse(path_, fmt::format("field 'NDims' is {}, but 'DimSize' has {} entries", count,
                                      sizes.size()));
        if (count > 4)
            refuse(path_, fmt::format("field 'NDims' is {}, at most 4 are supported", count));
        dimensions_ = static_cast<std::size_t>(count);
        const std::int64_t channels = one("ElementNumberOfChannels", 1);
        if (channels != 1) stored_.axes.push_back({Axis::channel, channels});
        constexpr Axis::Kind kKinds[] = {Axis::x, Axis::y, Axis::z, Axis::time};
        for (std::size_t i = 0; i < dimensions_; ++i) stored_.axes.push_back({kKinds[i], sizes[i]});
    }

    void geometry() {
        const std::size_t n = std::min<std::size_t>(dimensions_, 3);
        const auto steps = first_of({"ElementSpacing", "ElementSize"}, dimensions_);
        for (std::size_t i = 0; i < std::min(n, steps.size()); ++i)
            header_.spacing[i] = std::abs(steps[i]);
        check_spacing(header_, "ElementSpacing");
        for (std::size_t i = 0; i < std::min(n, steps.size()); ++i)
            if (steps[i] < 0)
                header_.warnings.push_back(fmt::format(
                    "{}: field 'ElementSpacing' is {}; taken as positive", path_, steps[i]));
        const auto offset = first_of({"Offset", "Position", "Origin"}, dimensions_);
        for (std::size_t i = 0; i < std::min(n, offset.size()); ++i) header_.origin[i] = offset[i];
        header_.unit = "mm";
        orientation(n);
        unit();
        check_spacing(header_, "Offset");
        const std::string slope = value("ElementToIntensityFunctionSlope", "");
        const std::string shift = value("ElementToIntensityFunctionOffset", "");
        header_.values = {
            slope.empty() ? 1 : doubles(path_, "ElementToIntensityFunctionSlope", slope).at(0),
            shift.empty() ? 0 : doubles(path_, "ElementToIntensityFunctionOffset", shift).at(0)};
        if (!std::isfinite(header_.values.slope) || !std::isfinite(header_.values.offset) ||
            header_.values.slope == 0)
            refuse(path_, "field 'ElementToIntensityFunctionSlope' is zero or not finite");
    }
    /// MetaIO means millimetres where it says nothing ("?").
    void unit() {
        const std::string unit = value("DistanceUnits", "");
        if (unit.empty() || unit == "?") return;
        const double factor = millimetres(unit);
        if (factor > 0) return to_millimetres(header_, factor);
        header_.unit.clear();
        header_.warnings.push_back(message(
            "{}: field 'DistanceUnits' is {}, which is no unit; @input_unit says which it is",
            path_, in_quotes(unit)));
    }
    /// Row i of TransformMatrix is where axis i points (as ITK reads it). AnatomicalOrientation
    /// names where each axis comes from: "RAI" is the identity in LPS.
    void orientation(std::size_t n) {
        const std::string letters = value("AnatomicalOrientation", "");
        const auto from = direction_of(letters);
        header_.anatomical = from.has_value();
        const auto matrix =
            first_of({"TransformMatrix", "Rotation", "Orientation"}, dimensions_ * dimensions_);
        if (!matrix.empty()) {
            std::array<Vector, 3> columns{Vector{1, 0, 0}, Vector{0, 1, 0}, Vector{0, 0, 1}};
            for (std::size_t i = 0; i < n; ++i)
                for (std::size_t j = 0; j < n; ++j) columns[i][j] = matrix[i * dimensions_ + j];
            const Vector spacing = header_.spacing;
            take_steps(header_, columns, "TransformMatrix");
            header_.spacing = spacing;
        } else if (from) {
            header_.direction = *from;
            for (Vector& column : header_.direction)
                for (double& entry : column) entry = 0 - entry;
        }
        if (!from || matrix.empty()) return;
        std::string opposite = letters_of(header_.direction);  // where axes point, not come from
        for (char& c : opposite) c = "RLAPIS"[std::string_view("LRPASI").find(c)];
        if (opposite != letters)
            header_.warnings.push_back(
                fmt::format("{}: field 'AnatomicalOrientation' is {}, but TransformMatrix says {}, "
                            "which is used",
                            path_, letters, opposite));
    }

    void data() {
        if (fields_.contains("BinaryData") && !truth("BinaryData"))
            stored_.encoding = Stored::Encoding::text;
        else if (truth("CompressedData"))
            stored_.encoding = Stored::Encoding::zlib;
        // CompressedDataSize is not needed, and is wrong in real files: the stream knows its end.
        stored_.big_endian = truth("BinaryDataByteOrderMSB", "ElementByteOrderMSB");
        for (const std::string& name : data_files()) stored_.pieces.push_back({name, 0});
        const std::int64_t skip = one("HeaderSize", 0);
        if (name_ == "LOCAL") stored_.pieces = {{path_, text_.end}};
        if (skip == 0) return;
        if (stored_.pieces.size() != 1 || stored_.encoding != Stored::Encoding::raw || skip < -1)
            refuse(path_, fmt::format("field 'HeaderSize' is {}: not supported here", skip));
        stored_.pieces[0].offset += skip > 0 ? static_cast<std::uint64_t>(skip) : from_end();
    }
    std::uint64_t from_end() const {
        std::int64_t bytes = static_cast<std::int64_t>(stored_.width());
        for (const Axis& axis : stored_.axes) bytes = product(path_, bytes, axis.size);
        const auto size = static_cast<std::int64_t>(File(stored_.pieces[0].path).size());
        return bytes > 0 && bytes < size ? static_cast<std::uint64_t>(size - bytes) : 0;
    }
    std::vector<std::string> data_files() {
        name_ = need("ElementDataFile");
        if (name_ == "LOCAL" || name_ == "Local" || name_ == "local") {
            name_ = "LOCAL";
            return {};
        }
        if (name_.starts_with("LIST")) return listed();
        const auto parts = words(name_);
        if (parts.size() < 2 || parts[0].find('%') == std::string_view::npos)
            return {beside(path_, name_)};
        const auto number = [&](std::size_t i, std::int64_t otherwise) {
            if (i >= parts.size()) return otherwise;
            const auto value = to_integer(parts[i]);
            if (!value)
                refuse(path_, "field 'ElementDataFile': '" + shown(parts[i]) + "' is no number");
            return *value;
        };
        return numbered_files(path_, parts[0], number(1, 1), number(2, stored_.axes.back().size),
                              number(3, 1));
    }
    std::vector<std::string> listed() const {
        Bytes rest(
            static_cast<std::size_t>(std::min<std::uint64_t>(file_.size() - text_.end, 16 << 20)));
        rest.resize(file_.read_some(text_.end, rest));
        const std::string_view all(reinterpret_cast<const char*>(rest.data()), rest.size());
        std::vector<std::string> files;
        for (std::string_view line : split(all, '\n'))
            if (!trim(line).empty()) files.push_back(beside(path_, line));
        return files;
    }

    std::string path_;
    File file_;
    HeaderText text_;
    std::map<std::string, std::string> fields_;
    std::string name_;
    std::size_t dimensions_ = 0;
    Header header_;
    Stored stored_;
};

}  // namespace

Header inspect_metaimage(const std::string& path) { return MetaImage(path).run(); }

}  // namespace edgewise::store
