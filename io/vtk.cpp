// Legacy VTK (.vtk), STRUCTURED_POINTS. Of its arrays the first SCALARS of the points are taken, or
// else the first other array of the points with up to four numbers a point (of a FIELD, VECTORS,
// COLOR_SCALARS), or else the same of the cells.

#include <algorithm>
#include <fmt/format.h>
#include <optional>

#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr int kMostLines = 10000;

struct TypeName {
    std::string_view name;
    Type type;
    Wide wide = Wide::no;
};
constexpr TypeName kTypes[] = {{"unsigned_char", Type::u8},
                               {"char", Type::i8},
                               {"signed_char", Type::i8},
                               {"unsigned_short", Type::u16},
                               {"short", Type::i16},
                               {"unsigned_int", Type::u32},
                               {"int", Type::i32},
                               {"float", Type::f32},
                               {"double", Type::f64},
                               {"vtkIdType", Type::i32},  // written as int
                               {"long", Type::f64, Wide::with_sign},
                               {"unsigned_long", Type::f64, Wide::without_sign},
                               {"vtktypeint64", Type::f64, Wide::with_sign},
                               {"vtktypeuint64", Type::f64, Wide::without_sign}};

class Vtk {
 public:
    explicit Vtk(const std::string& path) : path_(path), file_(path) {
        header_.file = path;
        header_.format = "VTK";
    }

    Header run() {
        preamble();
        std::vector<std::string> fields;
        while (best_.rank < Rank::scalars_of_points && words_of_line(fields))
            if (!field(fields)) break;
        if (best_.rank == Rank::none)
            refuse(path_, stored_.axes.empty() ? "field 'DIMENSIONS' is missing"
                                               : "holds no array of points or cells");
        finish();
        return std::move(header_);
    }

 private:
    /// Of what was found the highest is taken, of equals the first.
    enum class Rank { none, of_cells, scalars_of_cells, of_points, scalars_of_points };
    struct Found {
        Rank rank = Rank::none;
        TypeName type{};
        std::int64_t channels = 1;
        std::uint64_t at = 0;
        bool cells = false;
        bool colours = false;  // said to be colours, of any type
    };

    void finish() {
        if (best_.cells)
            for (std::size_t i = 0; i < 3; ++i) {
                std::int64_t& size = stored_.axes[i].size;
                // Samples of cells lie in their middles; along a flat axis cells are flat too.
                if (size > 1) header_.origin[i] += header_.spacing[i] / 2;
                size = std::max<std::int64_t>(size - 1, 1);
            }
        stored_.type = best_.type.type;
        stored_.wide = best_.type.wide;
        if (best_.channels > 1)
            stored_.axes.insert(stored_.axes.begin(), {Axis::channel, best_.channels});
        stored_.pieces = {{path_, best_.at}};
        take_axes(header_, stored_);
        take_bytes_of_colour(header_);
        if (best_.colours && (header_.channels == 3 || header_.channels == 4)) {
            header_.colour = true;
            if (header_.channels == 4) header_.alpha = Alpha::straight;
        }
        check_spacing(header_, "SPACING");
        take_reader(header_, std::move(stored_));
    }

    /// The next line, or nothing at the end of the file.
    std::optional<std::string> line() {
        Bytes bytes(kLongestLine);
        bytes.resize(file_.read_some(at_, bytes));
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        if (text.empty()) return std::nullopt;
        const auto end = text.find('\n');
        if (end == text.npos && text.size() == kLongestLine)
            refuse(path_, fmt::format("a header line longer than {} bytes", kLongestLine));
        if (++lines_ > kMostLines) refuse(path_, "the header has too many lines");
        at_ += std::min(end, text.size() - 1) + 1;
        return std::string(trim(text.substr(0, end)));
    }
    bool words_of_line(std::vector<std::string>& found) {
        found.clear();
        while (found.empty()) {
            const auto text = line();
            if (!text) return false;
            for (std::string_view word : words(*text)) found.emplace_back(word);
        }
        return true;
    }
    void preamble() {
        if (!line().value_or("").starts_with("# vtk DataFile Version"))
            refuse(path_, "not VTK: the first line is not '# vtk DataFile Version'");
        line();  // the title
        const std::string format = line().value_or("");
        if (format != "BINARY" && format != "ASCII")
            refuse(path_, "line 3 is '" + shown(format) + "', expected BINARY or ASCII");
        text_ = format == "ASCII";
        stored_.encoding = text_ ? Stored::Encoding::text : Stored::Encoding::raw;
        stored_.big_endian = true;  // as all binary legacy files
        std::vector<std::string> dataset;
        if (!words_of_line(dataset)) refuse(path_, "ends without DATASET");
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

    /// @return whether what follows can be read on
    bool field(const std::vector<std::string>& fields) {
        const std::string& name = fields[0];
        const auto width = [&](std::size_t index) {
            return index < fields.size() ? to_integer(fields[index]).value_or(0) : 0;
        };
        const std::string kind = fields.size() > 2 ? fields[2] : "";
        if (name == "DIMENSIONS")
            dimensions(fields);
        else if (name == "SPACING" || name == "ASPECT_RATIO")
            header_.spacing = three(fields);
        else if (name == "ORIGIN")
            header_.origin = three(fields);
        else if (name == "POINT_DATA" || name == "CELL_DATA")
            data_of(fields);
        else if (name == "SCALARS")
            return scalars(fields, kind);
        else if (name == "VECTORS" || name == "NORMALS")
            return array(name, kind, 3, tuples(name), false);
        else if (name == "TENSORS")
            return array(name, kind, 9, tuples(name), false);
        else if (name == "TENSORS6")
            return array(name, kind, 6, tuples(name), false);
        else if (name == "TEXTURE_COORDINATES")
            return array(name, fields.size() > 3 ? fields[3] : "", width(2), tuples(name), false);
        else if (name == "COLOR_SCALARS")  // bytes, or as text numbers from 0 to 1
            return array(name, text_ ? "float" : "unsigned_char", width(2), tuples(name), false);
        else if (name == "LOOKUP_TABLE")
            return array(name, text_ ? "float" : "unsigned_char", 4, width(2), false);
        else if (name == "GLOBAL_IDS" || name == "PEDIGREE_IDS")
            return array("", kind, 1, tuples(name), false);
        else if (name == "FIELD")
            return arrays_of_field(width(2));
        else if (name == "METADATA")
            while (!line().value_or("").empty()) {
            }
        else if (best_.rank == Rank::none)
            refuse(path_, in_quotes(name) + " is not supported before an array");
        else
            return false;
        return true;
    }
    std::int64_t tuples(const std::string& name) const {
        if (tuples_ == 0) refuse(path_, "field 'POINT_DATA' is missing before " + name);
        return tuples_;
    }
    bool scalars(const std::vector<std::string>& fields, const std::string& kind) {
        std::int64_t channels = 1;
        if (fields.size() > 3) channels = to_integer(fields[3]).value_or(0);
        if (channels < 1 || channels > 4)
            refuse(path_, "'SCALARS' has '" + shown(fields[3]) + "' components, expected 1 to 4");
        const std::uint64_t before = at_;
        std::vector<std::string> table;
        if (!words_of_line(table) || table[0] != "LOOKUP_TABLE") at_ = before;
        return array(fields[0], kind, channels, tuples(fields[0]), true);
    }
    bool arrays_of_field(std::int64_t count) {
        std::vector<std::string> fields;
        for (std::int64_t i = 0; i < count; ++i) {
            if (!words_of_line(fields)) refuse(path_, "ends inside a FIELD");
            if (fields[0] == "METADATA") {
                while (!line().value_or("").empty()) {
                }
                --i;
                continue;
            }
            const auto channels = fields.size() > 3 ? to_integer(fields[1]) : std::nullopt;
            const auto entries = fields.size() > 3 ? to_integer(fields[2]) : std::nullopt;
            if (!channels || !entries || *channels < 0 || *entries < 0)
                refuse(path_,
                       "an array of a FIELD needs name, components, tuples and type, found " +
                           in_quotes(fields[0]));
            // What is no array of the points or cells is read over.
            const bool fits = tuples_ > 0 && *entries == tuples_;
            if (!array(fits ? fields[0] : "", fields[3], *channels, *entries, false)) return false;
        }
        return true;
    }

    /// Notes an array that begins here, and passes it. One without a name is never taken.
    /// @return false where it cannot be passed, but something was found before
    bool array(const std::string& name, const std::string& kind, std::int64_t channels,
               std::int64_t entries, bool scalars) {
        const auto type = std::find_if(std::begin(kTypes), std::end(kTypes),
                                       [&](const TypeName& row) { return row.name == kind; });
        if (type == std::end(kTypes) && kind != "bit") {
            if (best_.rank != Rank::none) return false;
            refuse(path_,
                   in_quotes(name) + " has type " + in_quotes(kind) + ": unknown or not supported");
        }
        if (channels < 0 || entries < 0)
            refuse(path_, in_quotes(name) + " has a negative number of entries");
        const bool bits = type == std::end(kTypes);
        const std::int64_t numbers = product(path_, entries, channels);
        const std::uint64_t start = at_;
        if (!bits && !name.empty() && name != "LOOKUP_TABLE" && channels >= 1 && channels <= 4) {
            const Rank rank = cells_ ? (scalars ? Rank::scalars_of_cells : Rank::of_cells)
                                     : (scalars ? Rank::scalars_of_points : Rank::of_points);
            if (rank > best_.rank)
                best_ = {rank, *type, channels, start, cells_, name == "COLOR_SCALARS"};
            if (rank == Rank::scalars_of_points) return true;
        } else if (bits && scalars) {
            refuse(path_, in_quotes(name) + " has type 'bit', which is not supported");
        }
        if (text_) return skip_words(name, numbers);
        const std::int64_t width =
            bits ? 1 : static_cast<std::int64_t>(type->wide == Wide::no ? bytes_of(type->type) : 8);
        const std::int64_t bytes =
            bits ? numbers / 8 + (numbers % 8 > 0) : product(path_, numbers, width);
        if (static_cast<std::uint64_t>(bytes) > file_.size() - at_)
            refuse(path_, fmt::format("short data of {}: expected {} bytes, found {}",
                                      in_quotes(name), bytes, file_.size() - at_));
        at_ += static_cast<std::uint64_t>(bytes);
        return true;
    }
    bool skip_words(const std::string& name, std::int64_t count) {
        Bytes chunk(1 << 16);
        bool inside = false;
        while (count > 0) {
            const std::size_t got = file_.read_some(at_, chunk);
            if (got == 0 && count - inside == 0) return true;  // the last ends with the file
            if (got == 0)
                refuse(path_, fmt::format("short data of {}: {} numbers are missing",
                                          in_quotes(name), count - inside));
            std::size_t i = 0;
            for (; i < got && count > 0; ++i) {
                const char c = static_cast<char>(chunk[i]);
                const bool blank = c == ' ' || (c >= '\t' && c <= '\r');
                count -= blank && inside;
                inside = !blank;
            }
            at_ += i;
        }
        return true;
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
        cells_ = fields[0] == "CELL_DATA";
        std::int64_t expected = 1;
        for (const Axis& axis : stored_.axes)
            expected *= cells_ ? std::max<std::int64_t>(axis.size - 1, 1) : axis.size;
        if (counts.size() != 1 || counts[0] != expected)
            refuse(path_, fmt::format("field '{}' says {}, but DIMENSIONS make {}", fields[0],
                                      counts.empty() ? 0 : counts[0], expected));
        tuples_ = expected;
    }

    std::string path_;
    File file_;
    std::uint64_t at_ = 0;
    int lines_ = 0;
    bool text_ = false;
    bool cells_ = false;       // what is read now belongs to cells
    std::int64_t tuples_ = 0;  // of their arrays
    Found best_;
    Header header_;
    Stored stored_;
};

}  // namespace

Header inspect_vtk(const std::string& path) { return Vtk(path).run(); }

}  // namespace edgewise::store
