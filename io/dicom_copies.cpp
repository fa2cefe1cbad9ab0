#include "io/dicom_copies.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <utility>

#include "io/dicom_pixels.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

std::string name_of(const DicomFile& file) {
    return shown(std::filesystem::path(file.path).filename().string());
}

/// What tells images apart before anyone looks at their samples: size, number, time, and where
/// each frame lies.
std::string identity_of(const DicomFile& file) {
    std::string text =
        fmt::format("{} {} {} {} {} {} {} {}", file.columns, file.rows, file.frames, file.samples,
                    file.instance, file.acquisition, file.acquired, file.moment);
    const auto said = std::max<std::int64_t>(1, static_cast<std::int64_t>(file.each.size()));
    for (std::int64_t k = 0; k < said; ++k) {
        const DicomFrame frame = file.frame(k);
        text += fmt::format("|{} {}", frame.temporal, frame.segment);
        if (frame.position) text += fmt::format(" {}", fmt::join(*frame.position, ","));
        if (frame.tile) text += fmt::format(" {}", fmt::join(*frame.tile, ","));
        text += fmt::format(" {}", fmt::join(frame.dimensions, ","));
        if (frame.slope || frame.intercept)
            text += fmt::format(" {} {}", frame.slope.value_or(1), frame.intercept.value_or(0));
    }
    return text;
}

/// Decoded, so that a copy in another transfer syntax is known as one.
bool same_samples(const DicomFile& a, const DicomFile& b) {
    if (sample_type(a) != sample_type(b) || sample_channels(a) != sample_channels(b)) return false;
    DicomFrames of_a(a), of_b(b);
    for (std::int64_t k = 0; k < a.frames; ++k)
        if (!std::ranges::equal(of_a.frame(k), of_b.frame(k))) return false;
    return true;
}

/// FNV-1a of all samples: of many images that nothing else tells apart each is decoded once.
std::uint64_t hash_of(const DicomFile& file) {
    std::uint64_t hash = 0xcbf29ce484222325;
    DicomFrames frames(file);
    for (std::int64_t k = 0; k < file.frames; ++k)
        for (const std::byte byte : frames.frame(k))
            hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3;
    return hash;
}

}  // namespace

void leave_out_copies(std::vector<DicomFile>& files, Header& header) {
    std::map<std::string, std::vector<std::size_t>> alike;
    for (std::size_t i = 0; i < files.size(); ++i) alike[identity_of(files[i])].push_back(i);
    std::vector<bool> copy(files.size());
    std::size_t count = 0;
    std::pair<std::size_t, std::size_t> first;
    for (const auto& [identity, members] : alike) {
        if (members.size() < 2) continue;
        std::multimap<std::uint64_t, std::size_t> kept;
        for (const std::size_t member : members) {
            const std::uint64_t hash = hash_of(files[member]);
            const auto [begin, end] = kept.equal_range(hash);
            const auto found = std::find_if(begin, end, [&](const auto& one) {
                return same_samples(files[one.second], files[member]);
            });
            if (found == end) {
                kept.emplace(hash, member);
                continue;
            }
            copy[member] = true;
            if (count++ == 0 || member < first.second) first = {found->second, member};
        }
    }
    if (count == 0) return;
    header.warnings.push_back(
        fmt::format("{}: {} of {} files hold an image once more and are left out: '{}' is a copy "
                    "of '{}'{}",
                    header.file, count, files.size(), name_of(files[first.second]),
                    name_of(files[first.first]), count > 1 ? " and so on" : ""));
    std::size_t at = 0;
    std::erase_if(files, [&](const DicomFile&) { return copy[at++]; });
}

}  // namespace edgewise::store
