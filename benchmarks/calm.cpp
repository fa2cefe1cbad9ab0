// How calm a shared machine is: for how long calm moments of two threads last
// (cli/machine/pace.hpp), where data lie that were just read (cli/machine/data_lines.hpp), and how
// many rounds of reading it takes until the last cache keeps them.
//   calm_benchmark [SECONDS]
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <random>
#include <string>
#include <vector>

#include "cli/machine/data_lines.hpp"
#include "cli/machine/pace.hpp"
#include "graph/data.hpp"
#include "runtime/memory_budget.hpp"

namespace {

using namespace edgewise::cli;
using Clock = std::chrono::steady_clock;

constexpr int kThreads = 2;

double since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// @pre values is not empty
double quantile_of(std::vector<double> values, double part) {
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(part * double(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

struct Look {
    double at;  // [s]
    Pace pace;
};

void print_spells(const char* name, const std::vector<double>& milliseconds) {
    if (milliseconds.empty()) return;
    fmt::print(
        "{}: {} spells, quantiles .25 .5 .75 .9 .98: {:.2f} {:.2f} {:.2f} {:.2f} {:.1f} ms\n", name,
        milliseconds.size(), quantile_of(milliseconds, 0.25), quantile_of(milliseconds, 0.5),
        quantile_of(milliseconds, 0.75), quantile_of(milliseconds, 0.9),
        quantile_of(milliseconds, 0.98));
}

void look_for(double seconds) {
    std::vector<Look> looks;
    for (const auto begin = Clock::now(); since(begin) < seconds;) {
        const Pace pace = pace_now(kThreads);
        looks.push_back({since(begin), pace});
    }
    const Pace best = best_pace(kThreads);
    std::vector<bool> calm;
    for (const Look& look : looks) calm.push_back(is_calm(look.pace, best));
    const auto share = std::count(calm.begin(), calm.end(), true);
    fmt::print("{} looks, {:.0f} % of them calm; at best loop {:.1f} us, hop {:.0f} ns\n",
               looks.size(), 100.0 * double(share) / double(looks.size()), 1e6 * best.loop,
               1e9 * best.hop);
    std::vector<double> lasting, waiting;
    std::size_t first = 0;
    for (std::size_t i = 1; i < looks.size(); ++i) {
        if (calm[i] == calm[first]) continue;
        (calm[first] ? lasting : waiting).push_back(1e3 * (looks[i].at - looks[first].at));
        first = i;
    }
    print_spells("calm", lasting);
    print_spells("not calm", waiting);
    for (const double later : {0.001, 0.01, 0.03}) {
        std::size_t begins = 0, stays = 0, then = 0;
        for (std::size_t i = 0; i < looks.size(); ++i) {
            while (then < looks.size() && looks[then].at < looks[i].at + later) ++then;
            if (then == looks.size()) break;
            begins += calm[i];
            stays += calm[i] && calm[then];
        }
        if (begins > 0)
            fmt::print("{:.0f} ms after a calm look {:.0f} % are\n", 1e3 * later,
                       100.0 * double(stays) / double(begins));
    }
}

/// Where data lie between two runs that read them.
void lie(double seconds, std::int64_t mebibytes) {
    edgewise::MemoryBudget memory(std::size_t{1} << 28);
    edgewise::Representation what;
    what.type = edgewise::Type::u8;
    what.extent = {1 << 20, mebibytes, 1};
    edgewise::Data data = edgewise::Data::make(what, &memory);
    std::memset(data.samples.data(), 1, static_cast<std::size_t>(what.bytes()));
    volatile unsigned used = 0;
    std::vector<double> lines;
    for (const auto begin = Clock::now(); since(begin) < seconds;) {
        unsigned sum = 0;
        for (std::int64_t i = 0; i < what.samples(); i += 64) sum += data.as<unsigned char>()[i];
        used = sum;
        lines.push_back(1e9 * line_seconds(data));
    }
    static_cast<void>(used);
    const double least = *std::min_element(lines.begin(), lines.end());
    const auto near = std::count_if(lines.begin(), lines.end(),
                                    [&](double line) { return line <= kNearLines * least; });
    fmt::print(
        "{} MiB, ns a line after they were read: at best {:.0f}, quantiles .1 .5 .9: {:.0f} {:.0f} "
        "{:.0f}; near {:.0f} % of the time\n",
        mebibytes, least, quantile_of(lines, 0.1), quantile_of(lines, 0.5), quantile_of(lines, 0.9),
        100.0 * double(near) / double(lines.size()));
}

/// Nanoseconds a line of data read in random order, round by round, after others went by.
void warm_up(std::size_t mebibytes) {
    constexpr std::size_t kLine = 64, kOthers = 64u << 20;
    constexpr int kRounds = 20, kTimes = 60;
    const std::vector<unsigned char> data(mebibytes << 20, 1), others(kOthers, 1);
    std::vector<std::uint32_t> places(data.size() / kLine);
    for (std::size_t i = 0; i < places.size(); ++i)
        places[i] = static_cast<std::uint32_t>(i * kLine);
    std::mt19937 random(1);
    std::shuffle(places.begin(), places.end(), random);
    volatile unsigned used = 0;
    std::vector<std::vector<double>> rounds(kRounds);
    for (int time = 0; time < kTimes; ++time) {
        unsigned sum = 0;
        for (std::size_t i = 0; i < others.size(); i += kLine) sum += others[i];
        for (std::vector<double>& round : rounds) {
            const auto begin = Clock::now();
            for (const std::uint32_t place : places) sum += data[place];
            used = sum;
            round.push_back(1e9 * since(begin) / double(places.size()));
        }
    }
    static_cast<void>(used);
    fmt::print("{} MiB, ns a line:", mebibytes);
    for (const std::vector<double>& round : rounds) fmt::print(" {:.1f}", quantile_of(round, 0.5));
    fmt::print("\n");
}

}  // namespace

int main(int count, char** arguments) {
    const double seconds = count > 1 ? std::stod(arguments[1]) : 12;
    look_for(seconds);
    for (const std::int64_t mebibytes : {4, 8, 16, 32}) lie(seconds / 4, mebibytes);
    for (const std::size_t mebibytes : {3, 6, 8}) warm_up(mebibytes);
}
