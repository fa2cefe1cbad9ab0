#pragma once

#include <array>
#include <functional>
#include <memory_resource>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {

/// Lines of n samples read at m equally spaced places of their period, by phases of their spectra.
///
/// The field along a line is the trigonometric polynomial through its samples, which repeats after
/// n: f(x) = 1/n sum of w_j X_j exp(2 pi i j x / n) over |j| <= min(n, m) / 2. w_j is 1, and 1/2 at
/// both ends where min(n, m) is even. Where m < n, frequencies that m places cannot hold are left
/// out.
class PhaseLines {
 public:
    PhaseLines(std::int64_t n, std::int64_t m);

    std::int64_t from() const noexcept { return n_; }
    std::int64_t to() const noexcept { return m_; }
    /// Operations of one line: two transforms, and a product a frequency.
    static double operations(std::int64_t n, std::int64_t m) noexcept;

    /// Arrays of one thread.
    struct Line {
        Line(const PhaseLines& of, std::pmr::memory_resource* memory);
        static double bytes(std::int64_t n, std::int64_t m) noexcept;
        kernels::Block<float> in, out;
        kernels::Block<kernels::Complex> before, after;
    };
    /// line.out[k] = f(first + k n / m) of line.in.
    void run(Line& line, double first) const;

 private:
    std::int64_t n_, m_;
    kernels::Fourier forward_, back_;
};

/// All lines along an axis of an array, x fastest.
/// @param first  where a line begins, by its other two indices, ascending
/// @param out    may be `in`, where m places follow from m samples
void read_lines_at(const float* in, const Extent& n, int axis, std::int64_t m,
                   const std::function<double(std::int64_t, std::int64_t)>& first, float* out,
                   Context& context);

/// Samples of one channel as f32, row by row.
void read_as_f32(const Data& in, float* out, Context& context);

/// Why samples cannot be moved by phases, whatever the map; or "".
std::string no_phases(const Representation& from, const Ask& ask);

/// Along an axis: `to` places in a period of n samples; output sample 0 is at `first`.
struct PhaseAxis {
    std::int64_t from = 1, to = 1;
    double first = 0;

    bool scales() const noexcept { return from != to; }
    bool moves() const noexcept { return scales() || first != 0; }
};
/// What a view asks of each axis, where it scales and shifts axes alone.
/// @param refused  why it does not, or that a period holds no whole number of output samples
std::array<PhaseAxis, 3> phase_axes(const Representation& from, const Request& want, int view,
                                    std::string& refused);

/// An edge that reads each axis at places of its own.
/// @param scales  whether it serves views that scale, or those that do not
Transition phase_axes_edge(std::string name, std::string source, bool scales);

}  // namespace edgewise
