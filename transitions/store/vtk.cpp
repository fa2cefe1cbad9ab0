// Legacy VTK (.vtk), STRUCTURED_POINTS: the first SCALARS of the point data; other arrays are
// skipped.

#include <fmt/format.h>

#include "transitions/store/geometry.hpp"
#include "transitions/store/reader.hpp"
#include "transitions/store/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr int kMostLines = 10000;

struct TypeName {
    std::string_view name;
    Type type;
};
constexpr TypeName kTypes[] = {{"unsigned_char", Type::u8}, {"char", Type::i8},
                               {"signed_char", Type::i8},   {"unsigned_short", Type::u16},
                               {"short", Type::i16},        {"unsigned_int", Type::u32},
                               {"int", Type::i32},          {"float", Type::f32},
                               {"double", Type::f64}};

class Vtk {
 public:
    explicit Vtk(const std::string& path) : path_(path), file_(path) {
        header_.file = path;
        header_.format = "VTK";
    }

    Header run() {
        preamble();
        while (!found_) field(words_of_line());
        take_axes(header_, stored_);
        check_spacing(header_, "SPACING");
        check_pieces(path_, stored_);
        header_.reader = stored_reader(std::move(stored_));
        return std::move(header_);
    }

 private:
    std::string line() {
        Bytes bytes(kLongestLine);
        bytes.resize(file_.read_some(at_, bytes));
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        if (text.empty()) refuse(path_, "the header ends without SCALARS");
        const auto end = text.find('\n');
        if (end == text.npos && text.size() == kLongestLine)
            refuse(path_, fmt::format("a header line longer than {} bytes", kLongestLine));
        if (++lines_ > kMostLines) refuse(path_, "the header has too many lines");
        at_ += std::min(end, text.size() - 1) + 1;
        return std::string(trim(text.substr(0, end)));
    }
    std::vector<std::string> words_of_line() {
        for (;;) {
            const std::string text = line();
            std::vector<std::string> found;
            for (std::string_view word : words(text)) found.emplace_back(word);
            if (!found.empty()) return found;
        }
    }
    void preamble() {
        if (!line().starts_with("# vtk DataFile Version"))
            refuse(path_, "not VTK: the first line is not '# vtk DataFile Version'");
        line();  // the title
        const std::string format = line();
        if (format != "BINARY" && format != "ASCII")
            refuse(path_, "line 3 is '" + shown(format) + "', expected BINARY or ASCII");
        text_ = format == "ASCII";
        stored_.encoding = text_ ? Stored::Encoding::text : Stored::Encoding::raw;
        stored_.big_endian = true;  // as all binary legacy files
        const auto dataset = words_of_line();
        if (dataset.size() < 2 || dataset[0] != "DATASET" || dataset[1] != "STRUCTURED_POINTS")
            refuse(path_,
                   in_quotes(dataset.back()) + ": only DATASET STRUCTURED_POINTS is supported");
    }

    static std::string rest(const std::vector<std::string>& fields) {
        std::string text;
        for (std::size_t i = 1; i < fields.size(); ++i) text += fields[i] + " ";
        return text;
    }
    Vector three(const std::vector<std::string>& fields) const {
        const auto numbers = doubles(path_, fields[0], rest(fields));
        if (numbers.size() != 3)
            refuse(path_,
                   fmt::format("field '{}' has {} entries, expected 3", fields[0], numbers.size()));
        return {numbers[0], numbers[1], numbers[2]};
    }

    void field(const std::vector<std::string>& fields) {
        const std::string& name = fields[0];
        if (name == "DIMENSIONS")
            dimensions(fields);
        else if (name == "SPACING" || name == "ASPECT_RATIO")
            header_.spacing = three(fields);
        else if (name == "ORIGIN")
            header_.origin = three(fields);
        else if (name == "POINT_DATA" || name == "CELL_DATA")
            data_of(fields);
        else if (name == "SCALARS")
            scalars(fields);
        else if (name == "VECTORS" || name == "NORMALS")
            skip_array(fields, 2, 3);
        else if (name == "TENSORS")
            skip_array(fields, 2, 9);
        else if (name == "METADATA")
            while (!line().empty()) {
            }
        else
            refuse(path_, in_quotes(name) + " before SCALARS is not supported");
    }
    void dimensions(const std::vector<std::string>& fields) {
        const auto sizes = integers(path_, fields[0], rest(fields));
        if (sizes.size() != 3 || !stored_.axes.empty())
            refuse(path_, "field 'DIMENSIONS' is repeated or has no 3 entries");
        constexpr Axis::Kind kKinds[] = {Axis::x, Axis::y, Axis::z};
        for (std::size_t i = 0; i < 3; ++i) stored_.axes.push_back({kKinds[i], sizes[i]});
        Header checked = header_;
        stored_.type = Type::f64;  // the widest: the product must fit whatever the arrays are
        take_axes(checked, stored_);
    }
    void data_of(const std::vector<std::string>& fields) {
        if (stored_.axes.empty()) refuse(path_, "field 'DIMENSIONS' is missing");
        const auto counts = integers(path_, fields[0], rest(fields));
        const bool point = fields[0] == "POINT_DATA";
        if (!point) refuse(path_, "CELL_DATA are not supported");
        if (counts.size() != 1 || counts[0] != stored_.numbers())
            refuse(path_, fmt::format("field '{}' says {} points, but DIMENSIONS are {}", fields[0],
                                      counts.empty() ? 0 : counts[0], stored_.numbers()));
        points_ = counts[0];
    }
    Type type_of(const std::vector<std::string>& fields, std::size_t index) const {
        if (points_ == 0) refuse(path_, "field 'POINT_DATA' is missing before " + fields[0]);
        for (const TypeName& row : kTypes)
            if (index < fields.size() && row.name == fields[index]) return row.type;
        refuse(path_, fmt::format("'{}' has type '{}': unknown or not supported", fields[0],
                                  index < fields.size() ? shown(fields[index]) : ""));
    }
    void scalars(const std::vector<std::string>& fields) {
        stored_.type = type_of(fields, 2);
        std::int64_t channels = 1;
        if (fields.size() > 3) channels = to_integer(fields[3]).value_or(0);
        if (channels < 1 || channels > 4)
            refuse(path_, "'SCALARS' has '" + shown(fields[3]) + "' components, expected 1 to 4");
        if (channels > 1) stored_.axes.insert(stored_.axes.begin(), {Axis::channel, channels});
        const std::uint64_t before = at_;
        if (const auto table = words_of_line(); table[0] != "LOOKUP_TABLE") at_ = before;
        stored_.pieces = {{path_, at_}};
        found_ = true;
    }
    void skip_array(const std::vector<std::string>& fields, std::size_t index, std::int64_t width) {
        if (text_)
            refuse(path_,
                   in_quotes(fields[0]) + " before SCALARS in an ASCII file is not supported");
        const auto bytes = static_cast<std::int64_t>(bytes_of(type_of(fields, index)));
        const std::int64_t skipped = product(path_, product(path_, points_, width), bytes);
        if (static_cast<std::uint64_t>(skipped) > file_.size() - at_)
            refuse(path_, "short data of '" + fields[0] + "'");
        at_ += static_cast<std::uint64_t>(skipped);
    }

    std::string path_;
    File file_;
    std::uint64_t at_ = 0;
    int lines_ = 0;
    bool text_ = false, found_ = false;
    std::int64_t points_ = 0;
    Header header_;
    Stored stored_;
};

}  // namespace

Header inspect_vtk(const std::string& path) { return Vtk(path).run(); }

}  // namespace edgewise::store
