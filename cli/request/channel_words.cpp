#include "cli/request/channel_words.hpp"

#include <fmt/format.h>
#include <limits>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "request/numbers.hpp"
#include "settings/selection.hpp"

namespace edgewise::cli {

bool names_colours(const JobOptions& options) {
    const std::optional<std::string> channel = options.text("channel");
    return channel && names_several_channels(*channel);
}

std::vector<ChannelSpec> channels_of(const std::string& text) {
    std::vector<ChannelSpec> channels;
    if (same_word(text, kAll)) return channels;
    for (const std::string& word : split(text, ',')) {
        const std::size_t at = word.find('=');
        ChannelSpec& channel = channels.emplace_back();
        const std::string which = word.substr(0, at);
        if (is_channel_name(which))
            channel.name = which;
        else
            channel.channel = static_cast<int>(
                whole_of(setting("channel"), which, 0, std::numeric_limits<int>::max()));
        if (at == word.npos) continue;
        channel.colour = store::colour_of(word.substr(at + 1));
        if (!channel.colour)
            throw RequestError(fmt::format(
                "--channel: '{}' is no colour; expected red, green, blue, cyan, magenta, yellow, "
                "grey or six digits as #00ff80",
                word.substr(at + 1)));
    }
    return channels;
}

}  // namespace edgewise::cli
