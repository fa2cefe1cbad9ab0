#include "io/tiff_directory.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <string_view>
#include <unordered_set>

#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kMostPages = 1 << 20;
constexpr std::uint64_t kMostEntries = 4096;
constexpr std::uint64_t kMostStrips = 1 << 26;
constexpr std::uint64_t kMostParts = 1 << 16;

class Directory {
 public:
    explicit Directory(const File& file) : file_(file) {
        std::byte head[16];
        const std::size_t got = file.read_some(0, head);
        const bool little = got >= 8 && head[0] == std::byte{'I'} && head[1] == std::byte{'I'};
        big_ = got >= 8 && head[0] == std::byte{'M'} && head[1] == std::byte{'M'};
        const auto version = little || big_ ? number(head + 2, 2) : 0;
        if (version != 42 && version != 43) refuse(file.path(), "not TIFF: wrong signature");
        wide_ = version == 43;
        if (wide_ && got < 16) refuse(file.path(), "too short for a BigTIFF header");
        next_ = wide_ ? number(head + 8, 8) : number(head + 4, 4);
    }

    std::vector<TiffPage> pages() {
        std::vector<TiffPage> pages;
        std::unordered_set<std::uint64_t> seen;
        while (next_ != 0) {
            if (!seen.insert(next_).second)
                refuse(file_.path(),
                       fmt::format("the directory at byte {} comes back: endless pages", next_));
            if (pages.size() == kMostPages) refuse(file_.path(), "has too many pages");
            pages.push_back(page());
            check(pages.back());
        }
        if (pages.empty()) refuse(file_.path(), "has no page");
        return pages;
    }

 private:
    std::uint64_t number(const std::byte* at, std::size_t width) const {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < width; ++i)
            value |= std::to_integer<std::uint64_t>(at[i]) << 8 * (big_ ? width - 1 - i : i);
        return value;
    }
    static std::size_t width_of(std::uint64_t type) {
        constexpr std::size_t kWidths[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
        return type < std::size(kWidths) ? kWidths[type] : 0;
    }

    struct Entry {
        std::uint64_t tag, type, count, at;  // at: where the values are
    };

    TiffPage page() {
        TiffPage page;
        page.at = next_;
        page.big_endian = big_;
        offsets_ = {};
        const std::size_t entry_bytes = wide_ ? 20 : 12, count_bytes = wide_ ? 8 : 2;
        std::byte raw[20];
        file_.read(next_, std::span(raw).first(count_bytes), "a directory");
        const std::uint64_t entries = number(raw, count_bytes);
        if (entries > kMostEntries)
            refuse(file_.path(),
                   fmt::format("the directory at byte {} has {} entries", next_, entries));
        for (std::uint64_t i = 0; i < entries; ++i) {
            const std::uint64_t at = next_ + count_bytes + i * entry_bytes;
            file_.read(at, std::span(raw).first(entry_bytes), "a directory");
            Entry entry{number(raw, 2), number(raw + 2, 2), number(raw + 4, wide_ ? 8 : 4),
                        at + (wide_ ? 12 : 8)};
            const std::size_t inside = wide_ ? 8 : 4;
            if (width_of(entry.type) == 0 || entry.count == 0) continue;
            if (entry.count > file_.size() / width_of(entry.type))
                refuse(file_.path(), fmt::format("tag {} at byte {} claims {} values", entry.tag,
                                                 at, entry.count));
            if (entry.count * width_of(entry.type) > inside)
                entry.at = number(raw + (wide_ ? 12 : 8), inside);
            if (entry.count * width_of(entry.type) >
                file_.size() - std::min(entry.at, file_.size()))
                refuse(file_.path(),
                       fmt::format("values of tag {} lie beyond the end of the file", entry.tag));
            take(page, entry);
        }
        const std::uint64_t end = next_ + count_bytes + entries * entry_bytes;
        file_.read(end, std::span(raw).first(wide_ ? 8 : 4), "a directory");
        next_ = number(raw, wide_ ? 8 : 4);
        return page;
    }
    std::uint64_t value(const Entry& entry, std::uint64_t index) const {
        std::byte raw[8];
        const std::size_t width = width_of(entry.type);
        file_.read(entry.at + index * width, std::span(raw).first(width), "a tag");
        return number(raw, width);
    }
    int small(const Entry& entry) const {
        return static_cast<int>(std::min<std::uint64_t>(value(entry, 0), 1 << 20));
    }
    double real(const Entry& entry) const {
        std::byte raw[8];
        if (entry.type != 5) return static_cast<double>(value(entry, 0));
        file_.read(entry.at, raw, "a tag");
        const auto below = static_cast<double>(number(raw + 4, 4));
        return below == 0 ? 0 : static_cast<double>(number(raw, 4)) / below;
    }
    void take(TiffPage& page, const Entry& entry) {
        switch (entry.tag) {
            case 254:
                page.reduced = value(entry, 0) & 1;
                break;
            case 256:
                page.width = static_cast<std::int64_t>(value(entry, 0));
                break;
            case 257:
                page.height = static_cast<std::int64_t>(value(entry, 0));
                break;
            case 258:
                page.bits = small(entry);
                for (std::uint64_t i = 1; i < std::min<std::uint64_t>(entry.count, 8); ++i)
                    page.mixed |= static_cast<int>(value(entry, i)) != page.bits;
                break;
            case 259:
                page.compression = small(entry);
                break;
            case 262:
                page.photometric = small(entry);
                break;
            case 270:
                page.text = entry.at;
                page.text_bytes = entry.count * width_of(entry.type);
                break;
            case 282:
            case 283:
                page.resolution[entry.tag - 282] = real(entry);
                break;
            case 296:
                page.resolution_unit = small(entry);
                break;
            case 320:
                if (entry.type != 3 || entry.count > 3 << 16) break;
                for (std::uint64_t i = 0; i < entry.count; ++i)
                    page.colours.push_back(static_cast<std::uint16_t>(value(entry, i)));
                break;
            case 273:
            case 324:
                offsets_ = entry;
                break;
            case 274:
                page.orientation = small(entry);
                break;
            case 277:
                page.samples = small(entry);
                break;
            case 279:
            case 325:
                strips(page, entry);
                break;
            case 284:
                page.planar = small(entry);
                break;
            case 338:
                page.premultiplied = value(entry, 0) == 1;
                page.alpha = value(entry, 0) == 1 || value(entry, 0) == 2;
                break;
            case 339:
                page.format = small(entry);
                break;
            case 34675:
                page.icc = entry.at;
                page.icc_bytes = entry.count;
                break;
            case 50838:
                page.imagej_parts.clear();
                if (entry.type != 4 || entry.count > kMostParts) break;
                for (std::uint64_t i = 0; i < entry.count; ++i)
                    page.imagej_parts.push_back(static_cast<std::uint32_t>(value(entry, i)));
                break;
            case 50839:
                page.imagej = entry.at;
                page.imagej_bytes = entry.count * width_of(entry.type);
                break;
            default:
                break;
        }
    }
    /// Entries are sorted by tag, so the offsets came before.
    void strips(TiffPage& page, const Entry& counts) {
        if (offsets_.count != counts.count || counts.count > kMostStrips)
            refuse(file_.path(), fmt::format("{} strip offsets, but {} strip sizes", offsets_.count,
                                             counts.count));
        for (std::uint64_t i = 0; i < counts.count; ++i) {
            const std::uint64_t at = value(offsets_, i), bytes = value(counts, i);
            if (at > file_.size() || bytes > file_.size() - at)
                refuse(file_.path(),
                       fmt::format("strip {} ({} bytes at byte {}) lies beyond the end of the file",
                                   i, bytes, at));
            if (i == 0) page.first = at;
            page.in_one_piece = (i == 0 || page.in_one_piece) && at == page.first + page.stored;
            page.stored += bytes;
        }
    }
    void check(const TiffPage& page) const {
        if (page.width < 1 || page.height < 1)
            refuse(file_.path(),
                   fmt::format("is {} x {} pixels, expected 1 or more", page.width, page.height));
        if (page.bits < 1 || page.bits > 64 || page.samples < 1 || page.samples > 64)
            refuse(file_.path(),
                   fmt::format("{} samples of {} bits are not supported", page.samples, page.bits));
        const std::int64_t pixels = product(file_.path(), page.width, page.height);
        const std::int64_t bytes =
            product(file_.path(), pixels, std::int64_t{page.bits} * page.samples) / 8;
        const std::int64_t most = page.compression == 1 ? 1 : kTiffDensest;
        if (bytes / most > static_cast<std::int64_t>(page.stored))
            refuse(file_.path(), fmt::format("{} x {} pixels do not fit into {} bytes of strips",
                                             page.width, page.height, page.stored));
    }

    const File& file_;
    bool big_ = false, wide_ = false;
    std::uint64_t next_ = 0;
    Entry offsets_{};
};

}  // namespace

bool is_tiff(std::span<const std::byte> head) noexcept {
    if (head.size() < 4) return false;
    const std::string_view text(reinterpret_cast<const char*>(head.data()), 4);
    using namespace std::string_view_literals;
    return text == "II*\0"sv || text == "MM\0*"sv || text == "II+\0"sv || text == "MM\0+"sv;
}

std::vector<TiffPage> tiff_pages(const File& file) { return Directory(file).pages(); }

}  // namespace edgewise::store
