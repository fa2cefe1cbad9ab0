// The transform of a padded volume, by spectrum_of_volume and by FFTW's own plans in three
// dimensions: one thread, in turns, medians, and the errors of all against a transform in f64.
//   transforms_benchmark [SIDE[xPADDING]...] [--rounds N] [--patient SECONDS]
//   transforms_benchmark --lengths: operations a second of sixteen lines at once, by their length
// Ours begins at the samples; FFTW begins at a padded array that is there already, which costs it
// nothing. Windows are of four taps; of padding 1 they are linear. Prints a Markdown table.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fftw3.h>
#include <fmt/format.h>
#include <functional>
#include <memory_resource>
#include <random>
#include <string>
#include <string_view>
#include <tbb/global_control.h>
#include <vector>

#include "transitions/kernels/spectrum.hpp"

namespace {

using namespace edgewise;
using namespace edgewise::kernels;
using Clock = std::chrono::steady_clock;

double seconds_of(const std::function<void()>& run) {
    const auto begin = Clock::now();
    run();
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// An array of FFTW's alignment.
template <class T>
class Aligned {
 public:
    explicit Aligned(std::int64_t n)
        : n_(n), data_(static_cast<T*>(fftw_malloc(sizeof(T) * static_cast<std::size_t>(n)))) {
        if (!data_) throw std::bad_alloc();
        std::fill_n(data_, n, T{});
    }
    ~Aligned() { fftw_free(data_); }
    Aligned(const Aligned&) = delete;
    Aligned& operator=(const Aligned&) = delete;
    T* data() { return data_; }
    T& operator[](std::int64_t i) { return data_[i]; }
    std::int64_t size() const { return n_; }

 private:
    std::int64_t n_;
    T* data_;
};

/// What FFTW is given: samples over the window's transform, the origin voxel first.
template <class T>
void pad(const std::vector<float>& samples, const SpectrumShape& shape, T* out) {
    std::vector<double> weights[3];
    for (int axis = 0; axis < 3; ++axis)
        for (std::int64_t i = 0; i < shape.volume[axis]; ++i)
            weights[axis].push_back(
                1 / shape.window.transform(static_cast<double>(i - shape.origin()[axis]) /
                                           static_cast<double>(shape.period[axis])));
    const auto [nx, ny, nz] = std::array{shape.volume.x, shape.volume.y, shape.volume.z};
    const auto at = [&](int axis, std::int64_t i) {
        const std::int64_t k = i - shape.origin()[axis];
        return k < 0 ? k + shape.period[axis] : k;
    };
    for (std::int64_t z = 0; z < nz; ++z)
        for (std::int64_t y = 0; y < ny; ++y)
            for (std::int64_t x = 0; x < nx; ++x)
                out[(at(2, z) * shape.period.y + at(1, y)) * shape.period.x + at(0, x)] =
                    static_cast<T>(samples[static_cast<std::size_t>((z * ny + y) * nx + x)] *
                                   weights[0][x] * weights[1][y] * weights[2][z]);
}

/// Root mean square of a transform's error over that of the transform.
/// @param row, before  where its rows lie
double error_of(const Complex* made, std::int64_t row, std::int64_t before, const Extent& period,
                fftw_complex* exact) {
    double wrong = 0, all = 0;
    const std::int64_t half = period.x / 2 + 1;
    for (std::int64_t line = 0; line < period.y * period.z; ++line)
        for (std::int64_t x = 0; x < half; ++x) {
            const fftw_complex& truth = exact[line * half + x];
            const Complex got = made[line * row + before + x];
            wrong += std::pow(got.real() - truth[0], 2) + std::pow(got.imag() - truth[1], 2);
            all += truth[0] * truth[0] + truth[1] * truth[1];
        }
    return std::sqrt(wrong / all);
}

/// FFTW's wisdom of the lines of spectrum_of_volume, by timing: it then serves those plans too.
double plan_lines(const SpectrumShape& shape) {
    constexpr int kTogether = 16;
    const int half = static_cast<int>(shape.period.x / 2 + 1), rest = half % kTogether;
    const auto longest = std::max({shape.period.x, shape.period.y, shape.period.z});
    Aligned<Complex> tile(kTogether * longest);
    Aligned<float> row(shape.period.x);
    auto* samples = reinterpret_cast<fftwf_complex*>(tile.data());
    return seconds_of([&] {
        for (const int axis : {1, 2})
            for (const int lines : {kTogether, rest}) {
                if (lines == 0) continue;
                const int n = static_cast<int>(shape.period[axis]);
                fftwf_destroy_plan(fftwf_plan_many_dft(1, &n, lines, samples, nullptr, 1, n,
                                                       samples, nullptr, 1, n, FFTW_FORWARD,
                                                       FFTW_MEASURE));
            }
        fftwf_destroy_plan(fftwf_plan_dft_r2c_1d(static_cast<int>(shape.period.x), row.data(),
                                                 samples, FFTW_MEASURE | FFTW_PRESERVE_INPUT));
    });
}

struct Plan {
    std::string name;
    fftwf_plan plan;
    double planning;
};

void measure(std::int64_t side, double padding, int rounds, double patience) {
    const KaiserBessel window(padding == 1 ? 2 : 4, padding);
    const SpectrumShape shape({side, side, side}, window);
    const Extent& period = shape.period;
    const std::int64_t half = period.x / 2 + 1;
    std::vector<float> samples(static_cast<std::size_t>(side * side * side) + 64);
    std::mt19937 random(1);
    for (float& sample : samples) sample = std::uniform_real_distribution<float>()(random);
    const Grid grid{
        .samples = samples.data(), .type = Type::f32, .extent = shape.volume, .values = {}};

    Aligned<float> padded(period.samples());
    Aligned<Complex> theirs(half * period.y * period.z), ours(shape.stored().samples());
    const int lengths[] = {static_cast<int>(period.z), static_cast<int>(period.y),
                           static_cast<int>(period.x)};
    std::vector<Plan> plans;
    for (const auto& [name, flag] :
         {std::pair{"ESTIMATE", FFTW_ESTIMATE}, std::pair{"MEASURE", FFTW_MEASURE},
          std::pair{"PATIENT", FFTW_PATIENT}}) {
        fftwf_plan plan = nullptr;
        fftwf_forget_wisdom();
        fftwf_set_timelimit(patience);
        const double planning = seconds_of([&] {
            plan = fftwf_plan_dft_r2c(3, lengths, padded.data(),
                                      reinterpret_cast<fftwf_complex*>(theirs.data()),
                                      flag | FFTW_PRESERVE_INPUT);
        });
        plans.push_back({name, plan, planning});
    }
    fftwf_forget_wisdom();
    fftwf_set_timelimit(FFTW_NO_TIMELIMIT);
    pad(samples, shape, padded.data());  // planning has overwritten it

    auto* memory = std::pmr::new_delete_resource();
    const auto run = [&] { spectrum_of_volume(grid, 0, shape, ours.data(), memory, {}); };
    run();
    std::vector<double> us, measured;
    std::vector<std::vector<double>> them(plans.size()), ratios(plans.size());
    for (int round = 0; round < rounds; ++round) {
        us.push_back(seconds_of(run));
        for (std::size_t i = 0; i < plans.size(); ++i) {
            them[i].push_back(seconds_of([&] { fftwf_execute(plans[i].plan); }));
            ratios[i].push_back(us.back() / them[i].back());
        }
    }

    fftwf_forget_wisdom();
    const double planning = plan_lines(shape);
    run();
    for (int round = 0; round < rounds; ++round) measured.push_back(seconds_of(run));
    fftwf_forget_wisdom();
    run();

    Aligned<double> exact_in(period.samples());
    auto* exact = static_cast<fftw_complex*>(
        fftw_malloc(sizeof(fftw_complex) * static_cast<std::size_t>(half * period.y * period.z)));
    fftw_plan in_f64 = fftw_plan_dft_r2c(3, lengths, exact_in.data(), exact, FFTW_ESTIMATE);
    pad(samples, shape, exact_in.data());
    fftw_execute(in_f64);
    fmt::print(
        "| {} | {} | ours | | {:.1f} | | {:.1e} |\n", side, period.x, 1e3 * median(us),
        error_of(ours.data(), shape.stored().x, SpectrumShape::kColumnsBefore, period, exact));
    fmt::print("| | | ours, measured | {:.2f} | {:.1f} | {:.2f} | |\n", planning,
               1e3 * median(measured), median(us) / median(measured));
    for (std::size_t i = 0; i < plans.size(); ++i) {
        fftwf_execute(plans[i].plan);
        fmt::print("| | | {} | {:.2f} | {:.1f} | {:.2f} | {:.1e} |\n", plans[i].name,
                   plans[i].planning, 1e3 * median(them[i]), median(ratios[i]),
                   error_of(theirs.data(), half, 0, period, exact));
        fftwf_destroy_plan(plans[i].plan);
    }
    fftw_destroy_plan(in_f64);
    fftw_free(exact);
}

/// Lines in a tile as spectrum_of_volume transforms them: 5 n log2 n operations each.
void measure_lengths() {
    constexpr int kTogether = 16, kRuns = 50;
    fmt::print("| length | a line [ns] | 1e9 operations a second |\n|---|---|---|\n");
    for (const int n : {60,  64,  80,  96,  100, 120, 128, 144, 150, 160, 192, 200, 240,
                        256, 288, 300, 320, 360, 384, 400, 448, 480, 512, 600, 640}) {
        Aligned<Complex> tile(kTogether * n);
        const Fourier fourier = Fourier::along_lines(n, kTogether, false);
        double least = HUGE_VAL;
        for (int round = 0; round < kRuns; ++round)
            least = std::min(least, seconds_of([&] {
                                        for (int i = 0; i < kRuns; ++i) fourier.run(tile.data());
                                    }) / kRuns /
                                        kTogether);
        fmt::print("| {} | {:.0f} | {:.0f} |\n", n, 1e9 * least,
                   1e-9 * fourier_operations(n) / least);
    }
}

}  // namespace

int main(int argc, char** argv) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    std::vector<std::pair<std::int64_t, double>> cases;
    int rounds = 9;
    double patience = 120;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--lengths") {
            measure_lengths();
            return 0;
        }
        if (word == "--rounds" && i + 1 < argc)
            rounds = std::atoi(argv[++i]);
        else if (word == "--patient" && i + 1 < argc)
            patience = std::atof(argv[++i]);
        else {
            const std::size_t by = word.find('x');
            cases.emplace_back(std::atoll(word.c_str()),
                               by == std::string::npos ? 1.25 : std::atof(word.c_str() + by + 1));
        }
    }
    if (cases.empty()) cases = {{128, 1}, {102, 1.25}, {64, 2}, {256, 1}, {204, 1.25}, {128, 2}};
    fmt::print(
        "| side | period | plan | planning [s] | run [ms] | ours / this | error |\n"
        "|---|---|---|---|---|---|---|\n");
    for (const auto& [side, padding] : cases) measure(side, padding, rounds, patience);
    return 0;
}
