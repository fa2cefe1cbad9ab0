#pragma once

#include <cmath>
#include <string_view>

namespace edgewise {

constexpr double kLineBytes = 64;  // that a cache reads at once

/// Cache lines that are read or written at computed addresses, all of one set of bytes.
struct Lines {
    double count = 0;
    /// Bytes of the set, of one rank: they decide which level of memory serves the lines.
    double span = 0;
};

/// What ranks exchange, as the thesis counts it.
struct Traffic {
    double local = 0;      // L: samples read from a neighbouring tile or rank
    double global = 0;     // G: samples sent to an arbitrary rank, one to one
    double congested = 0;  // G that may meet at one rank, before congestion N
    double messages = 0;   // one after another, of the rank that sends most
    double sent = 0;       // bytes in these messages
};

/// Counted for one run of one edge at one view, never timed: a machine profile makes seconds of it.
/// Where samples are spread over ranks, operations and accesses are the sum over ranks, which share
/// them evenly; messages and bytes in memory are those of one rank.
struct Work {
    /// Additions, multiplications, roundings, comparisons: one each, as [W93].
    double operations = 0;
    /// Operations to mask and weigh lanes of vectors: none where samples are worked out one by one.
    double masked = 0;
    double streamed = 0;  // bytes read or written in address order
    /// Bytes of the set that is streamed, of one rank. 0: the planner takes input and output.
    double swept = 0;
    double gathers = 0;  // reads at computed addresses; one a sample, also where they share a line
    /// Lines that gathers bring. All other reads are served by the first level of memory. A span
    /// of 0: the planner takes the whole input.
    Lines lines = {};
    /// Further lines: those that neighbouring rays read again, and those that the edge writes.
    Lines other_lines = {};
    Traffic traffic = {};
    double scratch = 0;    // bytes alive while one leaf runs, for each thread
    double workspace = 0;  // bytes alive while the step runs, whatever the number of threads
    /// The variant of the edge's kernel that the data lead to, where counts cannot predict that
    /// the variants differ in seconds. One word; empty for an edge of one variant. Each variant is
    /// timed by itself.
    std::string_view variant = {};
};

/// What an edge adds to the error of its output, and how it scales the error of its input.
/// Absolute, in the values of the output.
struct Error {
    double gain = 1;        // of bias
    double noise_gain = 1;  // of noise
    double bias = 0;        // blur, truncation, ghosts: of one sign, so they add
    double noise = 0;       // rounding, quantisation: independent, so squares add
    bool known = true;      // false: no finite estimate exists, until it is measured
    /// No new value appears: every sample is one of the input's, or the value outside, as exactly
    /// as f32 holds it. True also where the samples can be restored exactly from the result.
    bool copies = false;

    static Error unknown() noexcept { return {.known = false}; }
};

/// The resources of a path so far.
struct Label {
    double seconds = 0;
    double peak = 0;   // bytes
    double held = 0;   // bytes kept for the next views
    double bias = 0;   // values
    double noise = 0;  // values
    bool known = true;
    bool copied = true;  // every edge so far copies: rounding to the input's type changes nothing

    /// RMSE, in values.
    double error() const noexcept { return std::hypot(bias, noise); }
};

/// Whether a path is as good as Budget::like asks: yes; no, it reads by a filter that is barred;
/// no, its error is larger than that of the plain path, or not known.
enum class Likeness { alike, barred, worse };

/// What a plan or a step is expected to take.
struct Predicted {
    double seconds = 0;   // all frames
    double spread = 0;    // of seconds: standard deviation of the log
    double bytes = 0;     // peak at most: what budgets are held against
    double error = 0;     // NRMSE
    bool known = true;    // of error
    bool copied = false;  // Label::copied
    /// The peak that is expected: with frames side by side, without reserves. 0: as `bytes`.
    double expected = 0;
    Likeness likeness = Likeness::alike;  // of a plan; where nothing is asked for, alike

    double expected_bytes() const noexcept { return expected > 0 ? expected : bytes; }
};

}  // namespace edgewise
