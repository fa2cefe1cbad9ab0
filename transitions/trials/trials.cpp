#include "transitions/trials/trials.hpp"

#include <initializer_list>

#include "graph/kinds.hpp"

namespace edgewise {
namespace {

using Types = std::vector<Type>;
using Turn = std::vector<double>;

const Turn kSlightly{20, -15, 10};  // slices of the samples come before the eye in their order
const Types kWide{Type::u8, Type::f32}, kUsual{Type::u8, Type::i16, Type::f32};

/// What most requests resemble comes first.
enum Order {
    kCommon = 10,
    kImage,
    kInCaches,
    kSmall,
    kLarge,
    kLargest,
    kImages,
    kSparse,
    kDense,
    kLit,
    kFrames = 140,
    kCopies,
    kFromEye,
    kOthers,
    kQuarters
};

Job pictures() { return job_to("screen/picture"); }
Job warps() { return job_to("screen/scalar"); }

/// The same in several types.
void add(std::vector<Trial>& all, Trial trial, const Types& types) {
    for (const Type type : types) {
        trial.type = type;
        all.push_back(trial);
    }
}

/// Volumes that are both warped and shown.
// No slice of a volume beyond the first caches is a multiple of many pages. Such slices, above all
// of powers of two, use few sets of a cache (docs/planner.md) and would have rates of their own.
void add_volumes(std::vector<Trial>& all, const Trial& trial) {
    const auto volume = [&](const char* input, const Turn& turn, const Types& types, int order,
                            Trial::Part part = Trial::Part::full) {
        Trial one = trial;
        one.input = input;
        one.turn = turn;
        one.fine = trial.mode && (order == kCommon);
        one.part = part;
        one.order = order;
        add(all, one, types);
    };
    volume("phantom:gaussians:80", kSlightly, kWide, kCommon, Trial::Part::quick);
    volume("phantom:gaussians:112", kSlightly, kUsual, kCommon);
    volume("phantom:noise:48", {10, 70, -25}, kWide, kInCaches);
    volume("phantom:gaussians:190", {15, 40, -5}, kUsual, kLarge);
}

void add_exam(std::vector<Trial>& all, Trial trial, int order) {
    trial.part = Trial::Part::exam;
    trial.order = order;
    all.push_back(trial);
}

void add_exams(std::vector<Trial>& all, Mode mode, Combine loop) {
    const Trial trial{.job = pictures(), .input = "", .mode = mode};
    const auto exam = [&](const char* input, Type type, const Turn& turn, int order,
                          std::int64_t size = 0) {
        Trial one = trial;
        one.input = input;
        one.type = type;
        one.turn = turn;
        one.size = size;
        add_exam(all, one, order);
    };
    if (loop == Combine::max) exam("phantom:marschner-lobb:80", Type::u8, {-35, 25, 60}, 1);
    if (loop == Combine::sum) exam("phantom:sphere:128", Type::u8, {5, -50, 15}, 2);
    if (loop == Combine::over) exam("phantom:shepp-logan:96", Type::f32, {-20, 15, 40}, 3);
    if (loop == Combine::max) exam("phantom:cube:72", Type::u8, {40, 10, -20}, 5, 80);
}

/// Few pixels of large data: sparse rays, across slices, across rows or along them.
void add_sparse(std::vector<Trial>& all, Mode mode) {
    Trial trial{.job = pictures(), .input = "", .mode = mode, .order = kSparse};
    const std::vector<Turn> turns{{15, -30, 5}, {5, 60, 10}, {-3, 84, 4}};
    for (const Turn& turn : turns) {
        trial.input = "phantom:gaussians:190";
        trial.turn = turn;
        trial.size = 112;
        add(all, trial, kUsual);
    }
    for (std::size_t i = 0; i < 2; ++i)
        for (const std::int64_t size : {112, 256}) {
            trial.input = "phantom:gaussians:270";
            trial.turn = turns[i];
            trial.size = size;
            add(all, trial, {Type::u8});
        }
}

/// What is mostly empty, and many frames, in which threads have more to share.
void add_others(std::vector<Trial>& all, Mode mode, Combine loop) {
    const Turn turn{10, 30, 20};
    Trial trial{.job = pictures(), .input = "", .turn = turn, .mode = mode};
    const auto mostly_empty = [&](const char* input, const Types& types, int order) {
        trial.input = input;
        trial.order = order;
        add(all, trial, types);
    };
    if (loop == Combine::max) mostly_empty("phantom:shepp-logan:124", {Type::u8}, kOthers);
    if (loop != Combine::sum) return;
    mostly_empty("phantom:shepp-logan:64", kWide, kSmall);  // steps take as long as they start
    mostly_empty("phantom:shepp-logan:224", {Type::u8}, kOthers);
    mostly_empty("phantom:shepp-logan:124", {Type::f32}, kOthers);
    add(all,
        {.job = pictures(),
         .input = "phantom:gaussians:112",
         .turn = kSlightly,
         .mode = mode,
         .frames = 12,
         .order = kFrames},
        kWide);
}

}  // namespace

std::vector<Trial> picture_trials(Combine loop) {
    const Mode mode = mode_by(loop);
    std::vector<Trial> all;
    if (loop == Combine::mean) {  // as sums, but at the ends of rays
        add(all,
            {.job = pictures(),
             .input = "phantom:gaussians:112",
             .turn = kSlightly,
             .mode = mode,
             .order = kOthers},
            kWide);
        return all;
    }
    add_volumes(all, {.job = pictures(), .input = "", .mode = mode});
    add_sparse(all, mode);
    // More pixels than samples: ray casts read such data as they do what caches hold.
    add(all,
        {.job = pictures(),
         .input = "phantom:gaussians:190",
         .turn = {15, 40, -5},
         .mode = mode,
         .size = 480,
         .order = kDense},
        {Type::i16});
    add_others(all, mode, loop);
    add_exams(all, mode, loop);
    return all;
}

std::vector<Trial> picture_trials() {
    std::vector<Trial> all;
    for (const Combine loop : {Combine::max, Combine::sum, Combine::over, Combine::mean})
        join(all, picture_trials(loop));
    return all;
}

std::vector<Trial> lit_trials() {
    std::vector<Trial> all;
    add(all,
        {.job = pictures(),
         .input = "phantom:gaussians:112",
         .turn = kSlightly,
         .mode = mode_by(Combine::over),
         .lit = true,
         .order = kLit},
        kUsual);
    return all;
}

std::vector<Trial> perspective_trials() {
    std::vector<Trial> all;
    for (const char* input : {"phantom:gaussians:64", "phantom:gaussians:112"})
        for (const Combine loop : {Combine::max, Combine::sum})
            add(all,
                {.job = pictures(),
                 .input = input,
                 .turn = kSlightly,
                 .mode = mode_by(loop),
                 .perspective = 30,
                 .order = kFromEye},
                {Type::u8});
    return all;
}

std::vector<Trial> warp_trials() {
    std::vector<Trial> all;
    add_volumes(all, {.job = warps(), .input = ""});
    const auto warp = [&](const char* input, const Turn& turn, const Types& types, int order,
                          Trial::Part part = Trial::Part::full) {
        add(all, {.job = warps(), .input = input, .turn = turn, .part = part, .order = order},
            types);
    };
    warp("phantom:zone-plate:700", {20}, kWide, kImage, Trial::Part::quick);
    warp("phantom:zone-plate:900", {20}, kWide, kImage);
    warp("phantom:shepp-logan:64", {10, 30, 20}, kWide, kSmall);
    // 79 MB are written, more than caches keep.
    warp("phantom:gaussians:270", {15, 40, -5}, {Type::u8}, kLargest);
    warp("phantom:zone-plate:256", {20}, kWide, kImages);
    warp("phantom:zone-plate:500", {70}, kWide, kImages);
    warp("phantom:zone-plate:1400", {-35}, kWide, kImages);
    warp("phantom:zone-plate:2000", {20}, kWide, kImages);
    warp("phantom:gaussians:112", {90, 0, 0}, {Type::u8}, kQuarters);
    warp("phantom:gaussians:112", {90, 0, 90}, {Type::f32}, kQuarters);
    warp("phantom:sphere:96", {12, 33, -21}, {Type::u8}, 4, Trial::Part::exam);
    warp("phantom:checker:450", {-33}, {Type::f32}, 6, Trial::Part::exam);
    return all;
}

Trial copy_trial(const std::string& input, Type type, const std::vector<double>& turn) {
    return {.job = pictures(),
            .input = input,
            .type = type,
            .turn = turn,
            .mode = mode_by(Combine::sum),
            .alone = true,
            .order = kCopies};
}

Trial mesh_trial(const std::string& input, Type type) {
    return {.job = job_to("object/mesh"),
            .input = input,
            .type = type,
            .isovalue = 0.4,
            .alone = true,
            .order = kSurfaceTrials};
}

Trial surface_trial(const std::string& input, Type type) {
    Trial trial = mesh_trial(input, type);
    trial.job = pictures();
    trial.turn = kSlightly;
    trial.mode = mode_by(Combine::hit);
    return trial;
}

Trial of_labels(Trial trial) {
    trial.isovalue.reset();
    trial.labels = true;
    return trial;
}

}  // namespace edgewise
