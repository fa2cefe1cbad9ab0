#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

#include "graph/transfer_table.hpp"
#include "runtime/runtime.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/composite/classify.hpp"

namespace edgewise {
namespace {

/// Memory in which a read before the first or behind the last byte of an array ends the program:
/// arrays lie against a page that may not be read, at one end or the other. What is given back
/// is kept for the next array of as many pages, since new ones cost more than most edges: a read of
/// it shows what nobody wrote, a write to it ends the program.
class GuardedMemory : public std::pmr::memory_resource {
 public:
    explicit GuardedMemory(bool at_end) : at_end_(at_end) {}
    ~GuardedMemory() override {
        for (const auto& [pages, blocks] : free_)
            for (char* first : blocks) munmap(first - page_, pages + 2 * page_);
    }

 private:
    static constexpr char kUnwritten = '\xff';  // of floats a NaN: it shows where it is used

    struct Given {
        char* first;
        std::size_t pages;  // bytes between the two guards
    };

    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
        const std::size_t pages = (bytes + page_ - 1) / page_ * page_;
        char* const first = kept(pages);
        char* given = at_end_ ? first + (pages - bytes) / alignment * alignment : first;
        const std::lock_guard lock(mutex_);
        given_[given] = {first, pages};
        return given;
    }
    void do_deallocate(void* given, std::size_t, std::size_t) override {
        const std::lock_guard lock(mutex_);
        const auto found = given_.find(given);
        const auto [first, pages] = found->second;
        std::memset(first, kUnwritten, pages);
        free_[pages].push_back(first);
        given_.erase(found);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override {
        return this == &other;
    }

    /// Pages that nobody has written to, between two that may not be read.
    char* kept(std::size_t pages) {
        {
            const std::lock_guard lock(mutex_);
            std::vector<char*>& blocks = free_[pages];
            if (!blocks.empty()) {
                char* first = blocks.back();
                blocks.pop_back();
                if (std::any_of(first, first + pages, [](char c) { return c != kUnwritten; })) {
                    fmt::print(stderr, "memory was written to after it was given back\n");
                    std::abort();
                }
                return first;
            }
        }
        void* all = mmap(nullptr, pages + 2 * page_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (all == MAP_FAILED) throw std::bad_alloc();
        char* first = static_cast<char*>(all) + page_;
        if (mprotect(first, pages, PROT_READ | PROT_WRITE) != 0) throw std::bad_alloc();
        std::memset(first, kUnwritten, pages);
        return first;
    }

    bool at_end_;
    const std::size_t page_ = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    std::mutex mutex_;
    std::map<void*, Given> given_;
    std::map<std::size_t, std::vector<char*>> free_;
};

/// A copy of a box of data.
Data part_of(const Data& whole, const Region& box, std::pmr::memory_resource* memory) {
    Data part = Data::make(whole.what, box, memory);
    const std::size_t row =
        static_cast<std::size_t>(box.extent().x * whole.what.channels) * bytes_of(whole.what.type);
    for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            std::memcpy(part.row_at(box.begin[0], y, z), whole.row_at(box.begin[0], y, z), row);
    return part;
}

/// Samples of any type, with an edge in the middle.
Data samples_of(const Representation& what, std::pmr::memory_resource* memory) {
    Data data = Data::make(what, memory);
    std::mt19937 bits(7);
    const int numbers = what.channels * (what.type == Type::c64 ? 2 : 1);
    for (std::int64_t i = 0; i < what.samples() * numbers; ++i) {
        const bool high = i > what.samples() / 2;
        const auto value = static_cast<float>((high ? 120 : 10) + static_cast<int>(bits() % 50));
        if (what.type == Type::u8)
            data.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(value);
        else if (what.type == Type::i16)
            data.as<std::int16_t>()[i] = static_cast<std::int16_t>(value);
        else
            data.as<float>()[i] = value;
    }
    return data;
}

std::string first_difference(const Data& a, const Data& b) {
    if (a.what.type != Type::f32) return "";
    const auto count = static_cast<std::int64_t>(a.samples.bytes() / sizeof(float));
    for (std::int64_t i = 0; i < count; ++i)
        if (std::memcmp(a.as<float>() + i, b.as<float>() + i, sizeof(float)) != 0)
            return fmt::format("number {} of {}: {} for {}", i, count, a.as<float>()[i],
                               b.as<float>()[i]);
    return "";
}

struct Tried {
    std::map<std::string, int> edges = {};  // how often boxes were compared
    /// Of an edge's parameters every so many, others for each vertex: all of them come up, with
    /// some mode and some type.
    std::size_t stride = 1, next = 0;
    GuardedMemory at_end{true}, at_begin{false};
};

/// Runs an edge on all of its output, then box by box, from no more of the input than it says.
void expect_same_bytes(const Transition& edge, const Offer& offer, const Ask& ask, const Data& in,
                       Tried& tried) {
    const Partition parts = edge.parts(offer, ask);
    if (parts.kind != Partition::output || !parts.reads) return;
    SCOPED_TRACE(fmt::format("{}{} {} to {}", edge.name, offer.with.text(), offer.from.text(),
                             offer.to.text()));
    GuardedMemory &at_end = tried.at_end, &at_begin = tried.at_begin;
    Context context{&at_end, nullptr, nullptr, 0};
    Data whole = Data::make(offer.to, &at_end);
    edge.run(offer, ask, in, whole, Region::all(offer.to.extent), context);
    // The many boxes guard one end.
    const std::pair<int, GuardedMemory*> cuts[] = {
        {2, &at_end}, {2, &at_begin}, {5, &at_begin}, {27, &at_end}};
    for (const auto& [count, memory] : cuts) {
        context.memory = memory;
        for (const Region& box : boxes_of(offer.to.extent, count)) {
            Region read = parts.reads(box, 0);
            if (read.empty()) read = {{0, 0, 0}, {1, 1, 1}};
            const Data part = part_of(in, read, memory);
            Data out = Data::make(offer.to, box, memory);
            edge.run(offer, ask, part, out, box, context);
            const Data right = part_of(whole, box, std::pmr::get_default_resource());
            ASSERT_EQ(std::memcmp(out.samples.data(), right.samples.data(), right.samples.bytes()),
                      0)
                << count << " boxes: " << box.begin[0] << ' ' << box.begin[1] << ' ' << box.begin[2]
                << "; " << first_difference(out, right);
            ++tried.edges[edge.name];
        }
    }
}

/// Every filter and step that an edge takes, not only what planners try.
std::vector<Parameters> all_parameters(const Transition& edge) {
    std::vector<Parameters> all{{}};
    for (const auto& [key, domain] : edge.parameters) {
        std::vector<Parameters> longer;
        for (const Parameters& with : all)
            for (const Value& value :
                 domain.words.empty()
                     ? domain.tried
                     : std::vector<Value>(domain.words.begin(), domain.words.end())) {
                longer.push_back(with);
                longer.back().set(key, value);
            }
        all = std::move(longer);
    }
    return all;
}

TEST(Boxes, CutAnExtentWithoutGaps) {
    for (const Extent extent :
         {Extent{30, 20, 10}, Extent{31, 7, 1}, Extent{1, 1, 1}, Extent{3, 1, 2}})
        for (const int count : {1, 2, 5, 7, 16, 27}) {
            std::vector<int> covered(static_cast<std::size_t>(extent.samples()));
            for (const Region& box : boxes_of(extent, count)) {
                EXPECT_FALSE(box.empty());
                for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
                    for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                        for (std::int64_t x = box.begin[0]; x < box.end[0]; ++x)
                            ++covered[static_cast<std::size_t>(x + extent.x * (y + extent.y * z))];
            }
            EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), extent.samples());
        }
    EXPECT_EQ(boxes_of({60, 60, 60}, 27).size(), 27u);
    EXPECT_EQ(boxes_of({60, 50, 1}, 27).size(), 27u);
}

/// All edges that may be cut, from every vertex that they take, for one request.
/// @param only  of these edges; none: of all
void sweep(const Request& want, const std::vector<Representation>& from, Tried& tried,
           const std::set<std::string>& only = {}) {
    Scene scene;
    scene.low = scene.commonest = 0;
    scene.high = 255;
    scene.range = 100;
    for (int axis = 0; axis < want.axes; ++axis) {
        scene.occupied.begin[axis] = want.input[axis] / 3;
        scene.occupied.end[axis] = want.input[axis] / 2 + 1;
    }
    const Ask ask{want, scene};
    for (const Representation& what : from) {
        const Data in = samples_of(what, std::pmr::get_default_resource());
        for (const Transition& edge : catalogue()) {
            bool reads = false;
            for (const auto& [kind, to] : edge.joins) reads = reads || kind == what.kind();
            if (!reads || (!only.empty() && !only.contains(edge.name))) continue;
            const std::vector<Parameters> all = all_parameters(edge);
            const std::size_t stride = std::min(tried.stride, all.size());
            for (std::size_t i = tried.next++ % stride; i < all.size(); i += stride) {
                const Offer offer = edge.offer(what, ask, all[i]);
                if (offer.refused.empty()) expect_same_bytes(edge, offer, ask, in, tried);
                if (testing::Test::HasFatalFailure()) return;
            }
        }
    }
}

Representation volume(Type type, const Extent& extent = {23, 19, 17}) {
    Representation what;
    what.extent = extent;
    what.type = type;
    return what;
}

Transfer transfer() {
    return {.points = {{40, 0, {1, 0.2, 0.1}}, {160, 0.3, {0.3, 1, 0.6}}}, .unit = 1};
}

TEST(Boxes, OfAVolumeAreTheBytesOfTheWhole) {
    Tried tried;
    for (const Mat4& turn : {rotation(25, -40, 10), rotation(0, 0, 90), rotation(3, 0, 0)}) {
        Request want = request_of(Job::warp, Mode::mip, volume(Type::u8), {turn});
        std::vector<Representation> from = {volume(Type::u8), volume(Type::i16), volume(Type::f32)};
        from.push_back(volume(Type::f32));
        from.back().content = "coefficients";
        sweep(want, from, tried);
    }
    // Large enough that a box of it is worth a copy.
    const Representation large = volume(Type::i16, {64, 50, 60});
    sweep(request_of(Job::warp, Mode::mip, large, {rotation(0, 0, 90)}), {large}, tried,
          {"store.crop", "warp.axis_permutation"});
    for (const char* edge : {"warp.backward", "warp.permutation", "warp.shear",
                             "warp.axis_permutation", "store.crop", "store.precision"})
        EXPECT_GT(tried.edges[edge], 0) << edge;
}

TEST(Boxes, OfAnImageAreTheBytesOfTheWhole) {
    Tried tried;
    Representation image = volume(Type::u8, {45, 37, 1});
    image.axes = 2;
    image.channels = 3;
    Request want = request_of(Job::warp, Mode::mip, image, {rotation(0, 0, 33)});
    sweep(want, {image}, tried);
    image.channels = 1;
    sweep(want, {image}, tried);
    for (const char* edge : {"warp.backward", "warp.shear"}) EXPECT_GT(tried.edges[edge], 0);
}

/// The slices of a volume across the rays of a request.
Representation aligned(const Representation& what, const Request& want) {
    const Scene scene;
    for (const Transition& edge : catalogue())
        if (edge.name == "warp.axis_permutation")
            return edge.offer(what, {want, scene}, {{"to", "aligned"}}).to;
    return what;
}

TEST(Boxes, OfAPictureAreTheBytesOfTheWhole) {
    Tried tried{.stride = 12};
    for (const Mode mode : modes()) {
        SCOPED_TRACE(mode->name);
        for (const Mat4& turn : {rotation(25, -40, 10), rotation(0, 90, 0)}) {
            Request want = request_of(Job::render, mode, volume(Type::u8), {turn});
            want.transfer = transfer();
            std::vector<Representation> from = {volume(Type::u8), volume(Type::i16),
                                                volume(Type::f32)};
            from.push_back(volume(Type::f32));
            from.back().content = "coefficients";
            from.push_back(screen_scalar(volume(Type::f32), want));
            if (mode->combine == Combine::over)
                from.push_back(screen_classified(volume(Type::f32), want));
            for (const Type type : {Type::u8, Type::i16, Type::i32, Type::f32})
                from.push_back(aligned(volume(type), want));
            sweep(want, from, tried);
        }
    }
    // Wider than a tile of any edge.
    const Representation wide = volume(Type::u8, {150, 21, 17});
    for (const Mode mode : {Mode::mip, Mode::mean, Mode::composite}) {
        Request want = request_of(Job::render, mode, wide, {rotation(25, -30, 100)});
        want.transfer = transfer();
        sweep(want, {aligned(wide, want)}, tried);
    }
    for (const char* edge :
         {"project.ray_cast", "project.shear_warp", "project.combine", "composite.classify",
          "composite.back_to_front", "composite.front_to_back", "composite.binary_tree",
          "composite.binary_tree_front_to_back", "composite.attenuated_sum"})
        EXPECT_GT(tried.edges[edge], 0) << edge;
}

/// Every kind of light, each with something else that a sample's light depends on.
std::vector<Shading> shadings() {
    constexpr double kLeast = 1e-3;
    const Light aside{.towards = Vec3(0.6, 0, -0.8), .intensity = 0.5};
    return {{.by = Shade::phong, .least = kLeast},
            {.by = Shade::torrance_sparrow, .lights = {{}, aside}, .least = kLeast},
            {.by = Shade::particles, .lights = {aside}, .phase = 0.5},
            {.by = Shade::phong, .lights = {aside}, .shadows = true, .least = kLeast},
            {.by = Shade::phong, .occlusion = 4, .least = kLeast}};
}

TEST(Boxes, OfALitPictureAreTheBytesOfTheWhole) {
    Tried tried{.stride = 14};
    int lit = 0;
    for (const Mode mode : modes()) {
        if (!mode->takes_light()) continue;
        SCOPED_TRACE(mode->name);
        for (const Shading& shading : shadings()) {
            if (shading.has_shade() && !mode->takes_transfer) continue;
            for (const bool cued : {false, true}) {
                Request want =
                    request_of(Job::render, mode, volume(Type::u8), {rotation(25, -40, 10)});
                want.transfer = transfer();
                if (mode->takes_level) want.surface = SurfaceOf{100};
                SCOPED_TRACE(fmt::format("shade {}, shadows {}, occlusion {}, cue {}",
                                         static_cast<int>(shading.by), shading.shadows,
                                         shading.occlusion, cued));
                want.shading = shading;
                if (cued) want.cue = DepthCue{.per_length = 0.02};
                std::vector<Representation> from = {volume(Type::u8), volume(Type::f32),
                                                    volume(Type::f32)};
                from.back().content = "coefficients";
                sweep(want, from, tried);
                ++lit;
            }
        }
    }
    EXPECT_GE(lit, 4);
    EXPECT_GT(tried.edges["project.ray_cast"], 0);
}

/// Parts of a volume: a box, oblique planes, a slab, a ball.
std::vector<Clip> clips_of(const Extent& extent) {
    const auto plane = [&](const Vec3& normal, const Vec3& through) {
        const Vec3 unit = normal.normalized();
        return HalfSpace{unit, -unit.dot(through)};
    };
    const Vec3 middle(5.3, 4.9, 4.1);
    const std::vector<std::vector<HalfSpace>> all = {
        {plane({1, 0, 0}, {1.5, 0, 0}), plane({0, -1, 0}, {0, 7.5, 0})},
        {plane({2, 1, -1}, middle), plane({-1, 3, 1}, {3, 2, 4})},
        {plane({1, 1, 2}, {4, 3, 3}), plane({-1, -1, -2}, {6, 5, 5})}};
    std::vector<Clip> clips;
    for (const std::vector<HalfSpace>& planes : all) clips.push_back(clip_of(extent, planes));
    const Ball ball{middle, Eigen::Matrix3d(Vec3(0.24, 0.3, 0.27).asDiagonal())};
    clips.push_back(clip_of(extent, {}, std::span(&ball, 1)));
    return clips;
}

std::vector<Representation> small_volumes() {
    constexpr Extent kSmall{13, 11, 9};
    std::vector<Representation> from = {volume(Type::u8, kSmall), volume(Type::f32, kSmall)};
    from.back().content = "coefficients";
    return from;
}

TEST(Boxes, OfAClippedPictureAreTheBytesOfTheWhole) {
    Tried tried{.stride = 60};
    const std::vector<Representation> from = small_volumes();
    for (const Mode mode : {Mode::mip, Mode::composite, mode_named("surface")})
        for (const Clip& clip : clips_of(from[0].extent)) {
            SCOPED_TRACE(mode->name);
            Request want = request_of(Job::render, mode, from[0], {rotation(25, -40, 10)});
            want.transfer = transfer();
            want.clips = {clip};
            if (mode->takes_level) want.surface = SurfaceOf{100};
            want.shading.by = mode->shade;
            sweep(want, from, tried);
        }
    EXPECT_GT(tried.edges["project.ray_cast"], 0);
}

TEST(Boxes, OfAPictureByATableAreTheBytesOfTheWhole) {
    auto table = std::make_shared<TransferTable>();
    table->values = {20, 60, 120, 170};
    table->gradients = {0, 10, 45};
    table->opacity = {0, 0, 0.1, 0, 0.1, 0.4, 0, 0.3, 0.6, 0.05, 0.2, 0.9};
    const Transfer by_table =
        completed({.points = {}, .unit = 1, .edges = {}, .table = std::move(table)});
    Tried tried{.stride = 12};
    const std::vector<Representation> from = small_volumes();
    std::vector<Clip> clips = clips_of(from[0].extent);
    // Each clip, and none, with light or with a cue.
    for (std::size_t clip = 0; clip <= clips.size(); ++clip) {
        Request want = request_of(Job::render, Mode::composite, from[0], {rotation(25, -40, 10)});
        want.transfer = by_table;
        if (clip > 0) want.clips = {clips[clip - 1]};
        if (clip % 2 == 0) want.shading.by = Shade::phong;
        if (clip % 2 == 1) want.cue = DepthCue{.per_length = 0.02};
        sweep(want, from, tried);
    }
    EXPECT_GT(tried.edges["project.ray_cast"], 0);
}

TEST(Boxes, OfASliceOfASpectrumAreTheBytesOfTheWhole) {
    Tried tried;
    const Representation what = volume(Type::u8);
    for (const Field field : {Field::spline, Field::linear})
        for (const Mat4& turn : {rotation(25, -40, 10), rotation(0, 90, 0), rotation(0, 0, 0)}) {
            Request want = request_of(Job::render, Mode::mean, what, {turn});
            want.field = field;
            const Scene scene;
            std::vector<Representation> spectra;
            tried.stride = 3;
            for (const Transition& edge : catalogue()) {
                if (edge.name != "spectrum.forward") continue;
                for (const Parameters& with : all_parameters(edge))
                    spectra.push_back(edge.offer(what, {want, scene}, with).to);
            }
            sweep(want, spectra, tried);
        }
    EXPECT_GT(tried.edges["spectrum.slice"], 0);
}

TEST(Boxes, OfAPlanTakeLessMemoryForTheSameBytes) {
    constexpr std::size_t kLimit = std::size_t{1} << 30;
    MemoryBudget memory(kLimit);
    auto input = std::make_shared<Data>(
        samples_of(volume(Type::i16, {40, 36, 32}), std::pmr::get_default_resource()));
    int compared = 0;
    for (const Mode mode : {Mode::mip, Mode::composite}) {
        Request want = request_of(Job::render, mode, input->what,
                                  {rotation(25, -40, 10), rotation(25, 50, 10)});
        want.transfer = transfer();
        const Scene scene = scene_of(*input, want, memory);
        const Ask ask{want, scene};
        for (Plan path : paths_of(catalogue(), ask, input->what, 60)) {
            // Two steps, the first of which makes a volume that no one needs as a whole.
            if (path.steps.size() != 2 || path.steps[0].offer.to.space != "screen") continue;
            SCOPED_TRACE(fmt::format("{}", fmt::join(path.texts(), " ")));
            std::vector<std::vector<float>> whole;
            std::size_t peak = 0;
            for (const int boxes : {1, 2, 5, 27}) {
                MemoryBudget own(kLimit);
                path.boxes = boxes;
                const auto results = results_of(path, ask, input, 2, own);
                for (std::size_t frame = 0; frame < results.size(); ++frame) {
                    if (boxes == 1)
                        whole.push_back(values_of(*results[frame]));
                    else
                        EXPECT_EQ(values_of(*results[frame]), whole[frame]) << boxes << " boxes";
                }
                if (boxes == 1) peak = own.peak();
                if (boxes == 27) {
                    EXPECT_LT(own.peak(), 0.7 * static_cast<double>(peak));
                    ++compared;
                }
            }
        }
    }
    EXPECT_GE(compared, 4);
}

}  // namespace
}  // namespace edgewise
