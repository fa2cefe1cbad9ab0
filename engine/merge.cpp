#include "engine/merge.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "engine/result_writer.hpp"
#include "graph/errors.hpp"
#include "graph/mode.hpp"
#include "io/stain_colours.hpp"
#include "measure/machine.hpp"
#include "measure/quantiles.hpp"
#include "measure/since.hpp"
#include "presentation/sheet.hpp"
#include "request/resolution.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kColours = 3;

/// A mode that shows colours: merged pictures are written like its own.
Mode coloured_mode() {
    return *std::find_if(modes().begin(), modes().end(),
                         [](Mode mode) { return mode->over_background; });
}

/// Whether results are values of the data: largest, least and mean ones are.
bool shows_values(const ModeTraits& mode) {
    return mode.extreme != 0 || mode.slices == ModeTraits::Slices::mean;
}

/// The modes that show colours, for who asked for another.
std::string modes_of_colours() {
    std::string names;
    for (const Mode mode : modes())
        if (!mode->over_background) names += (names.empty() ? "" : ", ") + std::string(mode->name);
    return names;
}

/// Red, green and blue of one colour, each in its own.
std::vector<ChannelSpec> parts_of_colour() {
    return {{0, store::Colour{1, 0, 0}}, {1, store::Colour{0, 1, 0}}, {2, store::Colour{0, 0, 1}}};
}

/// Why channels of such a request cannot be merged is its own error, told at once.
void expect_mergeable(const Query& query) {
    if (!query.job->of_rays())
        throw RequestError(
            message("@channel: {} merges no channels; name one", name_of(query.job)));
    if (query.selection.channel)
        throw RequestError(message("@channel: several are merged, and one is selected as well"));
    if (query.transfer)
        throw RequestError(
            message("{}: its colours and those of channels exclude each other; without it light is "
                    "grey and takes the channel's colour",
                    query.transfer->from));
    if (query.suiting_preset)
        throw RequestError(
            message("@preset: its colours and those of channels exclude each other; "
                    "@mode(composite) has none"));
    if (query.background && *query.background != std::array<double, 3>{0, 0, 0})
        throw RequestError(message("@background: channels add up over black"));
    if (query.keeps_alpha)
        throw RequestError(message("@background: merged channels have no alpha"));
    if (query.ranks.value_or(1) > 1)
        throw RequestError(message("@ranks: channels are merged on one rank"));
}

/// The channels, each once, with their colours.
std::vector<MergedChannel> channels_of(const Merge& merge, const Input& input) {
    const int there = input.header.channels;
    std::vector<ChannelSpec> wanted = merge.wanted;
    if (wanted.empty() && input.header.colour) wanted = parts_of_colour();
    if (wanted.empty())
        for (int channel = 0; channel < there; ++channel) wanted.push_back({channel, {}});
    std::set<int> seen;
    for (ChannelSpec& one : wanted) {
        if (!one.name.empty())
            one.channel = store::channel_named(one.name, input.name, input.selection);
        if (one.channel < 0 || one.channel >= there)
            throw RequestError(message("@channel({}): {} has {} channel{}, counted from 0",
                                       one.channel, input.name, there, there > 1 ? "s" : ""));
        if (!seen.insert(one.channel).second)
            throw RequestError(message("@channel: {} is named twice", one.channel));
    }
    const bool asks_file = std::any_of(wanted.begin(), wanted.end(),
                                       [](const ChannelSpec& one) { return !one.colour; });
    const bool is_file = !input.phantom && !input.described && !input.pairs;
    std::vector<std::optional<store::Colour>> said;
    std::vector<std::string> names;
    const auto of_name = [&](int channel) -> std::optional<store::Colour> {
        const auto at = static_cast<std::size_t>(channel);
        return at < names.size() ? store::colour_by_name(names[at]) : std::nullopt;
    };
    if (asks_file && is_file) {
        said = store::channel_colours(input.name, input.selection);
        names = store::channel_names(input.name, input.selection);
    }
    std::vector<std::optional<std::array<double, 2>>> ranges;
    if (is_file) ranges = store::channel_ranges(input.name);
    std::set<store::Colour> taken;
    for (const ChannelSpec& one : wanted)
        if (const auto colour = of_name(one.channel)) taken.insert(*colour);
    std::vector<MergedChannel> channels;
    for (const ChannelSpec& one : wanted) {
        MergedChannel& channel = channels.emplace_back();
        channel.channel = one.channel;
        const auto at = static_cast<std::size_t>(one.channel);
        const auto of_file = at < said.size() ? said[at] : std::nullopt;
        const auto named = of_name(one.channel);
        channel.colour = one.colour ? *one.colour
                         : of_file  ? *of_file
                         : named    ? *named
                                    : store::free_colour(one.channel, taken);
        if (at < ranges.size()) channel.range = ranges[at];
        for (const double part : channel.colour)
            if (!(part >= 0 && part <= 1))
                throw RequestError(message("@channel: expected colours from 0 to 1"));
    }
    return channels;
}

Representation picture_of(const Extent& extent, int channels) {
    Representation what;
    what.space = "screen";
    what.content = "picture";
    what.axes = 2;
    what.extent = {extent.x, extent.y, 1};
    what.channels = channels;
    return what;
}

using Pictures = std::vector<std::shared_ptr<Data>>;  // a frame each

class Merging {
 public:
    Merging(Merge& merge, const std::function<void(MergedChannel&)>& planned,
            const MergedSink& sink)
        : merge_(merge), query_(merge.query), planned_(planned), sink_(sink) {}

    void run_all() {
        look();
        if (merge_.runs) open();
        for (std::size_t i = 0; i < found_.size(); ++i) {
            part_ = colours_ ? i : 0;
            merge_.channels.push_back(std::move(found_[i]));
            MergedChannel& channel = merge_.channels.back();
            plan_one(channel, static_cast<int>(found_.size() - i));
            if (planned_) planned_(channel);
            if (merge_.runs) render(channel);
            // One channel at a time: the next needs the room.
            if (!merge_.runs) channel.request->plan().input.data.reset();
            channel.request->planned()->memory->trim();
        }
        if (merge_.runs && colours_) add_colours();
        if (merge_.runs) end();
    }

 private:
    void poll() const {
        if (merge_.messages.stop()) throw Cancelled();
    }

    /// What the file is and what is to be written, before anything is read or planned.
    void look() {
        expect_mergeable(query_);
        outputs_ = outputs_of(query_);
        const InState unobserved(merge_.messages, Listener::State::unobserved);
        Request want = request_of(query_);
        Input input = inspected(query_.input, chosen_selection(query_, outputs_));
        if (merge_.runs && input.described)
            throw RequestError(
                fmt::format("{}: a description has no samples to run on", query_.input));
        found_ = channels_of(merge_, input);
        colours_ = merge_.wanted.empty() && input.header.colour;
        by_alpha_ = colours_ && input.header.alpha == store::Alpha::straight;
        bytes_ = input.header.type == Type::u8;
        if (colours_ && query_.mode->over_background)
            throw RequestError(
                message("@mode({}): {} holds colours, which have no opacity by their value; "
                        "@mode({}) show them, and @channel(0) takes one of red, green and blue",
                        query_.mode->name, input.name, modes_of_colours()));
        input.selection.channel = found_.front().channel;
        const Geometry geometry = take_geometry(want, query_, input, outputs_);
        merge_.frames = want.frames;
        merge_.extent = want.output();
        apart_ = query_.look.montage && merge_.frames == 1 && !colours_ && found_.size() > 1;
        if (apart_) {
            const int channels = static_cast<int>(found_.size());
            sheets_of(query_.look, channels);  // refuses what has no room
            pictures_of_each_ = channels;
            const auto [columns, rows] = *query_.look.montage;
            if (columns * rows > channels) ++pictures_of_each_;
        }
        if (const Message left_out = expect_frames(query_, outputs_, want.frames);
            !left_out.empty())
            merge_.messages.warning(left_out);
        writes_ = outputs_ && !outputs_->none();
        if (want.mode->over_background) shown_.exposure = query_.exposure.value_or(1);
        want.mode = coloured_mode();
        if (writes_) written_ = written_of(want, query_, geometry, input, *outputs_, 0, 1);
        // Colours are there, and no background is seen through them.
        written_.tail.channels = kColours;
        written_.tail.over_background = false;
        written_.tail.exposure.reset();
        for (const Message& warning : written_.warnings) merge_.messages.warning(warning);
    }

    /// The pictures are there from the beginning, so that the budgets of all channels count them.
    void open() {
        const auto frames = static_cast<std::size_t>(merge_.frames);
        const Representation value = picture_of(merge_.extent, 1),
                             colours = picture_of(merge_.extent, kColours);
        const std::size_t parts = colours_ ? found_.size() : 1;
        const double bytes = double(frames) * (double(parts) * value.bytes() +
                                               (apart_ ? pictures_of_each_ : 1) * colours.bytes());
        const double left = query_.max_memory ? *query_.max_memory - resident_now() : free_memory();
        if (bytes > left)
            throw NoPlan(message(
                "{}: {} pictures of merged channels take {:.0f} MiB, and {:.0f} MiB are left for "
                "them",
                query_.max_memory ? setting("max_memory") : "memory", frames, bytes / 0x1p20,
                std::max(0.0, left) / 0x1p20));
        // What the pictures are made of and what they are written as; budgets are the channels'.
        memory_ = std::make_unique<MemoryBudget>(static_cast<std::size_t>(2 * bytes) + kWriting);
        const auto add = [&](Pictures& to, const Representation& what) {
            poll();
            to.push_back(std::make_shared<Data>(Data::make(what, memory_.get())));
            Data& made = *to.back();
            std::fill_n(made.as<float>(), made.samples.bytes() / sizeof(float), 0.0f);
        };
        values_.resize(parts);
        for (std::size_t i = 0; i < frames; ++i) {
            for (Pictures& part : values_) add(part, value);
            for (int k = 0; k < (apart_ ? pictures_of_each_ : 1); ++k) add(pictures_, colours);
        }
    }

    Query spec_of(const MergedChannel& channel, int left) const {
        Query one = query_;
        one.selection.channel = channel.channel;
        one.selection.by_alpha = by_alpha_;
        const bool takes = shows_values(*one.mode) || (one.mode->takes_transfer && !one.transfer);
        if (!one.window && channel.range && takes)
            one.window = Window{{(*channel.range)[0], false}, {(*channel.range)[1], false}};
        one.out.reset();
        one.fps.reset();
        // Predicted, not measured: the same request has the same plans.
        if (query_.max_time)
            one.max_time = std::max(0.0, *query_.max_time - predicted_of(merge_).seconds) / left;
        return one;
    }

    void plan_one(MergedChannel& channel, int left) {
        const Query query = spec_of(channel, left);
        channel.request.emplace(ask(merge_.engine, query, {.runs = merge_.runs}));
        try {
            channel.request->prepare(merge_.effort, merge_.messages);
        } catch (const NoPlan& error) {
            const std::string share =
                query_.max_time && merge_.wanted.size() != 1
                    ? fmt::format(", for its share of {:.3g} s", *query.max_time)
                    : "";
            throw NoPlan(message("channel {}{}: {}", channel.channel, share, error.message()));
        }
    }

    void render(MergedChannel& channel) {
        // All of them together are held against it, when all have run.
        channel.request->plan().want.budget.seconds = query_.max_time;
        const auto pixels = static_cast<std::size_t>(merge_.extent.x * merge_.extent.y);
        const auto take = [&](int frame, const Data& result) {
            const auto channels = static_cast<std::size_t>(result.what.channels);
            const float* in = result.as<float>();
            float* out = values_[part_][static_cast<std::size_t>(frame)]->as<float>();
            // Of shades of grey, premultiplied and over black, one colour is all of them.
            for (std::size_t i = 0; i < pixels; ++i) out[i] = in[i * channels];
        };
        channel.request->run_all({.frames = take}, merge_.messages);
        if (colours_) return;
        const auto begin = Clock::now();
        const std::vector<std::shared_ptr<const Data>> values(values_[0].begin(), values_[0].end());
        channel.shades = shades_of(values, channel.request->planned()->window, shown_);
        add(values_[0], channel);
        merging_ += since(begin);
    }

    /// Red, green and blue go through one window, or colours would change: that of the request,
    /// else 0 to 255 of bytes, else 0 to the largest of all.
    void add_colours() {
        const auto begin = Clock::now();
        Shades shades{0, 255};
        if (const auto& window = merge_.channels[0].request->planned()->window;
            window || !bytes_ || !shows_values(*query_.mode)) {
            std::vector<std::shared_ptr<const Data>> all;
            for (const Pictures& part : values_) all.insert(all.end(), part.begin(), part.end());
            shades = shades_of(all, window, shown_);
            if (!window && shades.white > 0) shades.black = 0;
        }
        for (std::size_t i = 0; i < values_.size(); ++i) {
            merge_.channels[i].shades = shades;
            add(values_[i], merge_.channels[i]);
        }
        merging_ += since(begin);
    }

    /// The frames of one channel into the picture; or into one of its own, and into the last, which
    /// merges all, where a montage has room for it.
    void add(const Pictures& values, const MergedChannel& channel) const {
        if (apart_) {
            const std::size_t own = merge_.channels.size() - 1, last = found_.size();
            add(*values[0], *channel.shades, channel.colour, *pictures_[own]);
            if (pictures_.size() > last)
                add(*values[0], *channel.shades, channel.colour, *pictures_[last]);
            return;
        }
        for (std::size_t i = 0; i < values.size(); ++i) {
            poll();
            add(*values[i], *channel.shades, channel.colour, *pictures_[i]);
        }
    }

    static void add(const Data& values, const Shades& shades, const store::Colour& colour,
                    Data& picture) {
        const float* in = values.as<float>();
        float* out = picture.as<float>();
        const auto pixels = static_cast<std::size_t>(values.what.samples());
        const double range = shades.white - shades.black;
        constexpr std::size_t kLeaf = 1 << 14;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pixels, kLeaf), [&](const auto& part) {
            for (std::size_t i = part.begin(); i != part.end(); ++i) {
                const double shade = (in[i] - shades.black) / range;
                if (!(shade > 0) || !std::isfinite(in[i])) continue;
                for (std::size_t c = 0; c < kColours; ++c) {
                    float& sum = out[kColours * i + c];
                    sum = static_cast<float>(std::min(1.0, sum + colour[c] * std::min(1.0, shade)));
                }
            }
        });
    }

    void end() {
        measure();
        if (query_.strict && merge_.measured->kept == false)
            throw RunError(message("@strict: a budget is broken; nothing is written"));
        values_.clear();
        memory_->trim();
        const auto begin = Clock::now();
        std::optional<ResultWriter> writer;
        if (writes_)
            writer.emplace(*outputs_, written_, query_, static_cast<int>(pictures_.size()),
                           merge_.messages.stop());
        for (std::size_t i = 0; i < pictures_.size(); ++i) {
            poll();
            const int frame = static_cast<int>(i);
            if (sink_) sink_(frame, *pictures_[i]);
            if (writer) {
                const Array samples = finished(*pictures_[i], written_.tail, {0, 1}, memory_.get());
                for (std::string& file : writer->write(frame, samples.data(), {0, 1}))
                    merge_.files.push_back(std::move(file));
            }
            pictures_[i].reset();
        }
        merge_.measured->write_seconds = merging_ + since(begin);
    }

    /// Seconds of the channels add up, run by run; the error is that of the worst channel.
    void measure() {
        Measured& all = merge_.measured.emplace();
        all.seconds.assign(static_cast<std::size_t>(query_.repeat), 0);
        for (const MergedChannel& channel : merge_.channels) {
            const Measured& one = channel.request->run->measured;
            for (std::size_t i = 0; i < all.seconds.size(); ++i) all.seconds[i] += one.seconds[i];
            all.steps.insert(all.steps.end(), one.steps.begin(), one.steps.end());
            all.step_seconds.insert(all.step_seconds.end(), one.step_seconds.begin(),
                                    one.step_seconds.end());
            all.bytes = std::max(all.bytes, one.bytes);
            if (one.kept == false || (all.kept == true && !one.kept)) all.kept = one.kept;
            if (one.error && (!all.error || one.error->nrmse > all.error->nrmse))
                all.error = one.error;
        }
        const double took = median(all.seconds);
        if (!query_.max_time || took <= *query_.max_time) return;
        all.kept = false;
        merge_.messages.warning(
            fmt::format("time: {:.3g} s of all channels is beyond the budget of {:.3g} s", took,
                        *query_.max_time));
    }

    static constexpr std::size_t kWriting = 16 << 20;  // beside the pictures, for small ones

    Merge& merge_;
    const Query& query_;
    const std::function<void(MergedChannel&)>& planned_;
    const MergedSink& sink_;
    std::vector<MergedChannel> found_;
    bool colours_ = false;   // they are red, green and blue of one colour
    bool by_alpha_ = false;  // and multiplied by alpha before rays see them
    bool bytes_ = false;     // of 8 bits
    bool apart_ = false;     // each has a picture in a montage, and all together have one
    int pictures_of_each_ = 1;
    std::size_t part_ = 0;  // of values_, whose turn it is
    Tail shown_;            // what the results of channels are
    std::optional<Outputs> outputs_;
    bool writes_ = false;
    Written written_;
    std::unique_ptr<MemoryBudget> memory_;  // before all that gives back to it
    std::vector<Pictures> values_;          // of one channel, or of each part of a colour
    Pictures pictures_;                     // of all
    double merging_ = 0;
};

}  // namespace

void perform(Merge& merge, const std::function<void(MergedChannel&)>& planned,
             const MergedSink& sink) {
    merge.channels.clear();
    merge.files.clear();
    merge.measured.reset();
    Merging(merge, planned, sink).run_all();
}

Predicted predicted_of(const Merge& merge) {
    Predicted all;
    for (const MergedChannel& channel : merge.channels) {
        const Planned* planned = channel.request ? channel.request->planned() : nullptr;
        if (!planned || !planned->answer.plan) continue;
        const Predicted& one = planned->answer.plan->predicted;
        // One machine: channels are late together.
        all.spread = std::max(all.spread, one.spread);
        all.seconds += one.seconds;
        all.bytes = std::max(all.bytes, one.bytes);
        all.expected = std::max(all.expected, one.expected_bytes());
        all.error = std::max(all.error, one.error);
        all.known = all.known && one.known;
    }
    return all;
}

}  // namespace edgewise
