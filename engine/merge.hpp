#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/reached.hpp"
#include "io/channel_colours.hpp"

namespace edgewise {

/// A channel that is to be merged.
struct ChannelSpec {
    int channel = 0;  // of the file, from 0
    /// Absent: what the file says, else one by its number (store::colour_by_number).
    std::optional<store::Colour> colour;
    std::string name = {};  // in place of the number
};

/// A channel on its way into the picture.
struct MergedChannel {
    int channel = 0;
    store::Colour colour{};
    /// The values that the file says it is shown from and to.
    std::optional<std::array<double, 2>> range{};
    /// Its own request: plan, measurements. Its samples are given back when its turn is over.
    std::optional<Reached> request;
    std::optional<Shades> shades;  // of its result: what became black, what its full colour
};

/// Several channels of a volume in one picture. Each is rendered by a plan of its own, one after
/// another, so that memory holds the samples of one. Its result goes through its window (that of
/// the request, else its own range over all frames) and takes its colour; colours are added up and
/// end at 1. What is not finite adds nothing.
///
/// Channels that are red, green and blue of one colour (store::Header::colour), where none is
/// named, go through one window together. Straight colours are multiplied by their alpha before
/// rays meet them: what is transparent is black.
///
/// Budgets: seconds are those of all channels together: each is planned for an equal share of what
/// is left. Errors are each channel's own. Bytes are the process's, as always.
struct Merge {
    /// @param request   of all of them; its selection names no channel. Modes that deliver one
    /// value
    ///                  or, without a transfer function, shades of grey
    /// @param channels  empty: all that the input has
    /// @param listener  outlives it
    Merge(Query request, std::vector<ChannelSpec> asked, Engine means, Listener& listener)
        : query(std::move(request)),
          wanted(std::move(asked)),
          engine(std::move(means)),
          messages(listener) {}

    const Query query;
    const std::vector<ChannelSpec> wanted;
    const Engine engine;
    Listener& messages;
    bool runs = false;  // and is not only planned
    Effort effort;
    std::vector<MergedChannel> channels;  // as far as they have come
    Extent extent;                        // of the picture
    int frames = 1;
    std::optional<Measured> measured;  // the whole: seconds are sums, the error is the largest
    std::vector<std::string> files;    // written
};

/// Receives each frame of the merged picture in order: f32, three channels from 0 to 1.
using MergedSink = std::function<void(int frame, const Data& picture)>;

/// Plans all channels and, where `runs`, renders them and writes.
/// @param planned  told each channel that has a plan, before it runs
/// @throws RequestError, InputError, NoPlan, Cancelled, RunError, std::bad_alloc
void perform(Merge& merge, const std::function<void(MergedChannel&)>& planned = {},
             const MergedSink& sink = {});

/// What is predicted for all channels that have a plan: seconds add up, bytes and errors are the
/// largest.
Predicted predicted_of(const Merge& merge);

}  // namespace edgewise
