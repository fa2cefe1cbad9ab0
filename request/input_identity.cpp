#include "request/input_identity.hpp"

#include <chrono>
#include <filesystem>
#include <fmt/format.h>
#include <sys/stat.h>

#include "graph/fingerprint.hpp"
#include "request/input.hpp"

namespace edgewise {
namespace {

constexpr std::chrono::seconds kCoarsestClock{2};

std::optional<struct stat> status_of(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return std::nullopt;
    return status;
}

std::string text_of(const struct stat& s) {
    return fmt::format("{} {} {} {}.{:09} {}.{:09}", s.st_dev, s.st_ino, s.st_size,
                       s.st_mtim.tv_sec, s.st_mtim.tv_nsec, s.st_ctim.tv_sec, s.st_ctim.tv_nsec);
}

std::string absolute(const std::string& path) {
    std::error_code none;
    const auto canonical = std::filesystem::canonical(path, none);
    return none ? path : canonical.string();
}

/// How files become samples.
std::string decoding_of(const Input& input) {
    const store::Header& header = input.header;
    return fmt::format("{} {} {} {} {}|{} {}|{} {}|{}|{} {:a}", header.format, header.volume,
                       header.extent.x, header.extent.y, header.extent.z, input.channels(),
                       static_cast<int>(header.type), header.values.slope, header.values.offset,
                       input.premultiplied(), static_cast<int>(input.keep),
                       input.keep == Keep::labels ? input.outside : 0.0);
}

std::string selection_text(const store::Selection& pick) {
    const std::string padding = pick.nothing ? fmt::format("{}", *pick.nothing) : std::string("-");
    return fmt::format("|{}|{}|{}|{}|{}|{}|{}|{}|{}{}", pick.series.value_or("-"),
                       pick.time.value_or(-1), pick.channel.value_or(-1), pick.level.value_or(0),
                       pick.orient, fmt::join(pick.spacing, ","), pick.unit,
                       static_cast<int>(pick.padding), padding, pick.by_alpha ? "|by alpha" : "");
}

}  // namespace

std::optional<InputIdentity> identity_of_files(const Input& input) {
    if (input.described) return std::nullopt;
    if (input.phantom) return InputIdentity{input.name, input.name};
    const auto files = store::files_of(input.pairs ? *input.pairs : input.header);
    if (!files) return std::nullopt;
    // "raw:..." is no path, but says more than one.
    InputIdentity identity{absolute(input.header.file), {}};
    const auto newest = std::chrono::system_clock::to_time_t(input.inspected_at - kCoarsestClock);
    for (const std::string& file : *files) {
        const auto status = status_of(file);
        if (!status || status->st_mtim.tv_sec >= newest || status->st_ctim.tv_sec >= newest)
            return std::nullopt;
        identity.what += fmt::format("|{} {}", absolute(file), text_of(*status));
    }
    return identity;
}

std::optional<InputIdentity> identity_of(const Input& input) {
    std::optional<InputIdentity> identity = identity_of_files(input);
    if (!identity || input.phantom) return identity;
    identity->where += selection_text(input.selection);
    identity->what += "|" + decoding_of(input);
    return identity;
}

InputIdentity identity_of_samples(const Input& input) {
    const Data& data = *input.data;
    Fingerprint samples;
    samples.bytes(data.samples.data(), static_cast<std::size_t>(data.what.bytes()));
    const std::string what = data.what.text() + "|" + samples.text();
    return {what, what + "|" + decoding_of(input)};
}

}  // namespace edgewise
