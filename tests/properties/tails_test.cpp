// Nothing reads a byte beyond the samples of a caller, neither behind the last one nor before the
// first: samples stand against a page that cannot be read, and everything that reads input reads
// them.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <functional>
#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <random>
#include <set>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

#include "graph/filtering.hpp"
#include "graph/radon.hpp"
#include "reference/verify.hpp"
#include "scene/histogram.hpp"
#include "scene/ring_free.hpp"
#include "scene/scene.hpp"
#include "surface/mesh_measures.hpp"
#include "tests/properties/run_request.hpp"
#include "tests/vectors.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/kernels/slow_gathers.hpp"

namespace edgewise {
namespace {

/// The guard that is watched now. What reads it is let through, so that a test can say what it was
/// and go on.
std::atomic<char*> watched{nullptr};
std::atomic<std::size_t> watched_bytes{0};
std::atomic<bool> touched{false};

void let_through(int signal, siginfo_t* info, void*) {
    char* const guard = watched;
    char* const at = static_cast<char*>(info->si_addr);
    if (!guard || at < guard || at >= guard + watched_bytes) {
        std::signal(signal, SIG_DFL);
        return;
    }
    touched = true;
    mprotect(guard, watched_bytes, PROT_READ);
}

/// Pages of samples between two that cannot be read, which they touch at one end.
class Guarded {
 public:
    enum class Against { next, last };

    Guarded(std::size_t bytes, Against side) : side_(side) {
        page_ = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
        inner_ = (bytes + page_ - 1) / page_ * page_;
        all_ = static_cast<char*>(mmap(nullptr, inner_ + 2 * page_, PROT_READ | PROT_WRITE,
                                       MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
        if (all_ == MAP_FAILED) throw std::bad_alloc();
        samples_ = side == Against::next ? all_ + page_ + inner_ - bytes : all_ + page_;
        struct sigaction action = {};
        action.sa_sigaction = let_through;
        action.sa_flags = SA_SIGINFO | SA_NODEFER;
        sigaction(SIGSEGV, &action, &before_);
    }
    ~Guarded() {
        watched = nullptr;
        sigaction(SIGSEGV, &before_, nullptr);
        munmap(all_, inner_ + 2 * page_);
    }
    Guarded(const Guarded&) = delete;
    Guarded& operator=(const Guarded&) = delete;

    void* samples() { return samples_; }
    /// Whether what is called reads beyond.
    template <class Call>
    bool is_passed_by(Call&& call) {
        char* const guard = side_ == Against::next ? all_ + page_ + inner_ : all_;
        touched = false;
        watched_bytes = page_;
        watched = guard;
        mprotect(guard, page_, PROT_NONE);
        call();
        watched = nullptr;
        return touched;
    }

 private:
    Against side_;
    std::size_t page_ = 0, inner_ = 0;
    char *all_ = nullptr, *samples_ = nullptr;
    struct sigaction before_ = {};
};

constexpr Type kTypes[] = {Type::u8, Type::i8, Type::u16, Type::i16, Type::f32};

template <class Use>
void with_stored(Type type, Use&& use) {
    switch (type) {
        case Type::u8:
            return use(std::uint8_t());
        case Type::i8:
            return use(std::int8_t());
        case Type::u16:
            return use(std::uint16_t());
        case Type::i16:
            return use(std::int16_t());
        default:
            return use(float());
    }
}

struct Caller {
    std::shared_ptr<Guarded> memory;
    std::shared_ptr<const Data> data;
    std::shared_ptr<const Data> own;  // the same samples in memory of edgewise's own
};

/// Samples that a caller holds: numbers of 0 to 99, a third of them 0, and all of the first slice.
Caller caller_of(const Extent& extent, Type type, int channels, Guarded::Against side) {
    auto data = std::make_shared<Data>();
    data->what.extent = extent;
    data->what.axes = extent.z > 1 ? 3 : 2;
    data->what.type = type;
    data->what.channels = channels;
    const auto bytes = static_cast<std::size_t>(data->what.bytes());
    auto memory = std::make_shared<Guarded>(bytes, side);
    data->samples = Array::around(memory->samples(), bytes, memory);
    std::mt19937 bits(5);
    with_stored(type, [&](auto zero) {
        using T = decltype(zero);
        for (std::int64_t i = 0; i < extent.samples() * channels; ++i)
            data->as<T>()[i] = static_cast<T>(bits() % 3 == 0 ? 0 : bits() % 100);
        if (extent.z > 1) std::fill_n(data->as<T>(), extent.x * extent.y * channels, T{0});
    });
    auto own = std::make_shared<Data>(Data::make(data->what, std::pmr::new_delete_resource()));
    copy_box(*data, *own);
    return {memory, data, own};
}

std::string text_of(const Data& data) {
    const Extent& n = data.what.extent;
    return fmt::format("{} {}x{}x{}x{}", name_of(data.what.type), data.what.channels, n.x, n.y,
                       n.z);
}

/// The steps up to the first that leaves the samples of the caller behind.
std::string head_of(const Plan& path) {
    std::string head;
    for (const Step& step : path.steps) {
        head += step.text() + " ";
        if (!step.by->attaches && !step.offer.to.shares) break;
    }
    return head;
}

bool is_same(const Data& a, const Data& b) {
    if (const auto mesh = surface::mesh_in(b)) {
        const auto measured = [](const surface::Mesh& of) {
            const auto all = surface::measures_of(of, std::pmr::new_delete_resource());
            return std::tuple(all.vertices, all.triangles, all.area, all.volume);
        };
        const auto other = surface::mesh_in(a);
        return other && measured(*other) == measured(*mesh);
    }
    const std::size_t bytes = b.samples.bytes();
    return a.samples.bytes() == bytes &&
           (bytes == 0 || std::memcmp(a.samples.data(), b.samples.data(), bytes) == 0);
}

/// Tries everything that reads the input of a request.
class Tails {
 public:
    explicit Tails(std::set<std::string>& failures) : failures_(failures) {}

    void expect_kept(const std::string& who, const Caller& caller,
                     const std::function<void()>& call) {
        if (caller.memory->is_passed_by(call)) failures_.insert(who + ": " + text_of(*caller.data));
    }

    void try_request(const std::string& name, const Request& want, const Caller& caller) {
        const Data& data = *caller.data;
        Scene scene;
        expect_kept("scene " + name, caller, [&] { scene = scene_of(data, want, memory_); });
        expect_kept("counts " + name, caller,
                    [&] { count_scene(edges_, data, want, scene, &memory_); });
        const Ask ask{want, scene};
        std::set<std::string> tried;
        std::vector<Plan> paths = paths_of(edges_, ask, data.what, 500);
        for (const Transition& edge : edges_)
            if (edge.on_demand)
                for (Plan& path : paths_of(edges_, ask, data.what, 20, {.via = {{edge.name}}}))
                    paths.push_back(std::move(path));
        std::shared_ptr<const Data> result;
        for (const Plan& path : paths) {
            if (path.steps.empty() || !tried.insert(head_of(path)).second) continue;
            for (const Step& step : path.steps) {
                reached.insert(step.by->name);
                if (!step.by->attaches && !step.offer.to.shares) break;
            }
            const std::string who = fmt::format("{} by {}", name, head_of(path));
            expect_kept(who, caller,
                        [&] { result = results_of(path, ask, caller.data, 2, memory_)[0]; });
            const auto expected = results_of(path, ask, caller.own, 2, memory_)[0];
            if (!is_same(*result, *expected))
                failures_.insert(who + ", another result: " + text_of(data));
        }
        try_edges(name, ask, caller, tried);
        if (!result || result->other.has_value()) return;
        if (want.job->values == JobTraits::Values::other) return;
        expect_kept("verify " + name, caller, [&] {
            const ReferenceField field(data, want.field);
            Verifier verifier(want, field, 0, 1, &memory_);
            for (int frame = 0; frame < want.frames; ++frame) verifier.frame(frame, *result);
            verifier.finish();
        });
    }
    std::set<std::string> reached;

 private:
    /// Runs edges alone that read the input, by all their words, also those that lead nowhere from
    /// there, or that no planner would try.
    void try_edges(const std::string& name, const Ask& ask, const Caller& caller,
                   const std::set<std::string>& tried) {
        const Data in = with_slack(*caller.data, &memory_);
        for (const Transition& edge : edges_) {
            const bool joins = std::any_of(
                edge.joins.begin(), edge.joins.end(),
                [&](const auto& join) { return takes_kind(join.first, in.what.kind()); });
            if (!joins || !edge.views_refused(ask.want).empty()) continue;
            for (const Parameters& with : parameters_of(edge)) {
                if (tried.contains(edge.name + with.text() + " ")) continue;
                const Offer offer = edge.offer(in.what, ask, with);
                if (!offer.refused.empty() || offer.to.place != Place::memory) continue;
                reached.insert(edge.name);
                Data out =
                    edge.attaches ? Data::sharing(in, offer.to) : Data::make(offer.to, &memory_);
                const bool of_input = edge.parts(offer, ask).kind == Partition::input;
                Context context{.memory = &memory_};
                expect_kept(fmt::format("{} by {}{}", name, edge.name, with.text()), caller, [&] {
                    edge.run(offer, ask, in, out,
                             Region::all(of_input ? in.what.extent : offer.to.extent), context);
                });
            }
        }
    }
    static std::vector<Parameters> parameters_of(const Transition& edge) {
        std::vector<Parameters> all(1);
        for (const auto& [key, domain] : edge.parameters) {
            std::vector<Parameters> longer;
            for (const Parameters& one : all) {
                const auto add = [&, key = key](auto value) {
                    longer.push_back(one);
                    longer.back().set(key, value);
                };
                for (const std::string& word : domain.words) add(word);
                if (domain.words.empty()) add(domain.tried.at(0));
            }
            all = std::move(longer);
        }
        return all;
    }

    std::set<std::string>& failures_;
    MemoryBudget memory_{std::size_t{1} << 30};
    const Catalogue edges_ = catalogue();
};

Request warped(const Representation& what, Field field, const Mat4& turn, const Vec3& shift,
               double zoom = 1) {
    Request want = request_of(Job::warp, Mode::mip, what, {turn});
    Mat4 map = want.views.at(0).matrix();
    map.block<3, 1>(0, 3) += shift;
    if (zoom != 1) {
        Mat4 scale = Mat4::Identity();
        for (int axis = 0; axis < what.axes; ++axis) {
            scale(axis, axis) = zoom;
            want.screen[axis] = static_cast<std::int64_t>(zoom * double(what.extent[axis])) + 1;
        }
        map = scale * map;
    }
    want.views = Placement(map);
    want.field = field;
    return want;
}

Request seen(Mode mode, const Representation& what, const Mat4& turn) {
    Request want = request_of(Job::render, mode, what, {turn});
    want.transfer.points = {{0, 0, {0.2, 0, 0}}, {40, 0.05, {1, 0.5, 0.2}}, {99, 0.4, {1, 1, 1}}};
    if (mode->takes_level) want.surface = SurfaceOf{40.5};
    want.field = Field::linear;
    return want;
}

/// The same through an eye.
Request seen_near(Request want) {
    Eye eye;
    const double middle = double(want.screen.z - 1) / 2;
    eye.at = Vec3(double(want.screen.x - 1) / 2, double(want.screen.y - 1) / 2,
                  middle - 3 * double(want.screen.z));
    eye.plane = middle;
    want.eye = eye;
    return want;
}

/// The same of samples whose slices lie farther apart.
Request stretched(Request want, const Representation& what) {
    want.spacing = {1, 1, 1.6};
    Mat4 map = want.views.at(0).matrix(), apart = Mat4::Identity();
    apart(2, 2) = 1.6;
    apart(2, 3) = -0.3 * double(what.extent.z - 1);
    want.views = Placement(Mat4(map * apart));
    return want;
}

class TailsTest : public testing::TestWithParam<std::tuple<std::int64_t, bool>> {
 protected:
    void SetUp() override {
        const auto [target, slow] = GetParam();
        if (target && !has_vectors(target)) GTEST_SKIP();
        choose_vectors(target);
        kernels::set_gathers_slow(slow);
    }
    void TearDown() override {
        choose_vectors(0);
        kernels::set_gathers_slow(std::nullopt);
        for (const std::string& failure : failures_) ADD_FAILURE() << failure;
    }
    /// Calls use(caller) for samples of all types in the first shape, and of some in the others. In
    /// other vectors than this processor's best, and before samples, kernels are much the same: few
    /// are tried.
    template <class Use>
    void each(std::initializer_list<Extent> shapes, int channels, Use&& use) {
        const bool best = GetParam() == std::tuple{std::int64_t{0}, false};
        for (const Type type : kTypes)
            for (const Extent& shape : shapes) {
                const bool first = &shape == shapes.begin();
                const bool likely = type == Type::u8 || (type == Type::f32 && best);
                if (!(likely || (first && (best || type == Type::i16)))) continue;
                use(caller_of(shape, type, channels, Guarded::Against::next));
                if (first && type == Type::u8)
                    use(caller_of(shape, type, channels, Guarded::Against::last));
            }
    }
    std::set<std::string> failures_;
    Tails tails_{failures_};
};
INSTANTIATE_TEST_SUITE_P(Vectors, TailsTest,
                         testing::Values(std::tuple{std::int64_t{0}, false},
                                         std::tuple{std::int64_t{0}, true},
                                         std::tuple{std::int64_t{HWY_SSE4}, false}));

TEST_P(TailsTest, StatisticsReadTheSamplesAlone) {
    each({{7, 5, 3}, {17, 9, 4}, {33, 1, 1}, {1, 1, 1}, {1, 1, 37}, {70, 3, 1}}, 1,
         [&](const Caller& caller) {
             const Data& data = *caller.data;
             MemoryBudget memory(std::size_t{1} << 28);
             tails_.expect_kept("statistics", caller, [&] {
                 const Statistics statistics = statistics_of(data, &memory);
                 histogram_of(data, statistics);
                 Request want;
                 want.input = data.what.extent;
                 want.transfer.points = {{0, 0, {0, 0, 0}}, {50, 1, {1, 1, 1}}};
                 seen_slope(data, want);
             });
         });
}

TEST_P(TailsTest, WarpsReadTheSamplesAlone) {
    each({{17, 9, 4}, {7, 5, 3}, {1, 9, 9}, {33, 1, 1}, {33, 18, 1}}, 1, [&](const Caller& caller) {
        const Representation& what = caller.data->what;
        const bool flat = what.axes == 2;
        const Mat4 turn = flat ? rotation(0, 0, 25) : rotation(20, 35, -50);
        const Mat4 quarter = flat ? rotation(0, 0, 90) : rotation(90, 0, 90);
        for (const Field field : {Field::nearest, Field::linear, Field::spline}) {
            const std::string name(std::to_string(static_cast<int>(field)));
            const auto call = [&](const char* kind, const Request& want) {
                tails_.try_request(std::string("warp ") + kind + " " + name, want, caller);
            };
            call("turn", warped(what, field, turn, Vec3::Zero()));
            if (field == Field::spline) continue;
            call("quarter", warped(what, field, quarter, Vec3::Zero()));
            call("shift", warped(what, field, rotation(0, 0, 0), Vec3(1, 0, 0)));
            call("part", warped(what, field, rotation(0, 0, 0), Vec3(0.4, -0.3, 0)));
            call("zoom", warped(what, field, rotation(0, 0, 0), Vec3::Zero(), 2.3));
            call("small", warped(what, field, rotation(0, 0, 0), Vec3::Zero(), 0.4));
        }
    });
    EXPECT_GE(tails_.reached.size(), 6u) << "edges";
}

TEST_P(TailsTest, PicturesReadTheSamplesAlone) {
    each({{17, 9, 4}, {1, 9, 9}, {33, 2, 1}}, 1, [&](const Caller& caller) {
        const Representation& what = caller.data->what;
        for (const Mode mode : modes())
            for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, 35, -50)}) {
                const std::string name(name_of(mode));
                const Request want = seen(mode, what, turn);
                tails_.try_request(name, want, caller);
                if (turn(0, 0) == 1) continue;
                tails_.try_request(name + " near", seen_near(want), caller);
                tails_.try_request(name + " stretched", stretched(want, what), caller);
                if (mode->takes_cue) {
                    Request cued = want;
                    cued.cue = DepthCue{.per_length = 0.02, .linear = true};
                    tails_.try_request(name + " cued", cued, caller);
                }
                for (const Shade shade : mode->shades) {
                    Request lit = want;
                    lit.shading.by = shade;
                    tails_.try_request(fmt::format("{} {}", name, name_of(shade)), lit, caller);
                    if (shade != Shade::phong) continue;
                    lit.gradient = GradientScheme::sobel;
                    tails_.try_request(fmt::format("{} sobel", name), lit, caller);
                    lit.shading.shadows = true;
                    tails_.try_request(fmt::format("{} shadows", name), lit, caller);
                }
            }
    });
    EXPECT_GE(tails_.reached.size(), 30u) << "edges";
}

TEST_P(TailsTest, LargerPicturesReadTheSamplesAlone) {
    each({{37, 33, 5}}, 1, [&](const Caller& caller) {
        for (const char* mode : {"xray", "mean"})
            tails_.try_request(mode, seen(mode_named(mode), caller.data->what, rotation(9, 5, 3)),
                               caller);
    });
    EXPECT_GE(tails_.reached.size(), 10u) << "edges";
}

TEST_P(TailsTest, LabelPicturesReadTheSamplesAlone) {
    each({{17, 9, 4}, {7, 5, 3}}, 1, [&](const Caller& caller) {
        for (const Mode mode : modes()) {
            if (!mode->takes_level) continue;
            Request want = seen(mode, caller.data->what, rotation(20, 35, -50));
            want.surface = SurfaceOf{};
            want.field = Field::nearest;
            tails_.try_request("labels " + std::string(name_of(mode)), want, caller);
        }
    });
    EXPECT_GE(tails_.reached.size(), 5u) << "edges";
}

TEST_P(TailsTest, MeshesReadTheSamplesAlone) {
    each({{17, 9, 4}, {7, 5, 3}, {33, 2, 2}}, 1, [&](const Caller& caller) {
        for (const bool labels : {false, true}) {
            Request want = request_of(Job::warp, Mode::mip, caller.data->what, {Mat4::Identity()});
            want.job = Job::mesh;
            want.views = Placement(Mat4::Identity());
            want.screen = {1, 1, 1};
            want.surface = labels ? SurfaceOf{} : SurfaceOf{40.5};
            want.field = labels ? Field::nearest : Field::linear;
            want.budget = {.copied = true};
            tails_.try_request(labels ? "nets" : "mesh", want, caller);
        }
    });
    EXPECT_GE(tails_.reached.size(), 2u) << "edges";
}

TEST_P(TailsTest, FiltersReadTheSamplesAlone) {
    for (const int channels : {1, 3})
        each({{7, 5, 3}, {17, 9, 4}, {39, 18, 1}}, channels, [&](const Caller& caller) {
            const Representation& what = caller.data->what;
            for (const FilterOp op : filter_ops()) {
                std::vector<Stencil> stencils = {Stencil::box(3, what.axes, has_weights(op)),
                                                 Stencil::ball(2, what.axes, has_weights(op))};
                if (has_weights(op)) stencils.push_back(Stencil::gauss(1.2, what.axes));
                for (const Stencil& stencil : stencils)
                    for (const Border border : {Border::mirror}) {
                        Request want;
                        want.job = Job::filter;
                        want.axes = what.axes;
                        want.input = want.screen = what.extent;
                        Filtering by{.op = op, .stencil = stencil, .border = border};
                        if (op == FilterOp::gradient)
                            for (int axis = 0; axis < what.axes; ++axis)
                                by.derivatives.push_back(Stencil::sobel(axis, what.axes));
                        want.setting = JobSetting::of(by);
                        tails_.try_request(
                            fmt::format("filter {} {}", name_of(op), name_of(border)), want,
                            caller);
                    }
            }
        });
    EXPECT_GE(tails_.reached.size(), 12u) << "edges";
}

TEST_P(TailsTest, LinesReadTheSamplesAlone) {
    each({{33, 33, 2}, {17, 9, 1}}, 1, [&](const Caller& caller) {
        const Representation& what = caller.data->what;
        using To = RadonSetting::To;
        for (const To to : {To::sinogram, To::hough, To::image}) {
            RadonSetting setting{.angles = 9, .to = to, .threshold = 50};
            if (to == To::image) setting.angles = static_cast<int>(what.extent.y);
            Request want;
            want.job = radon_job();
            want.axes = what.axes;
            want.input = want.screen = what.extent;
            want.setting = JobSetting::of(setting);
            tails_.try_request(fmt::format("lines {}", static_cast<int>(to)), want, caller);
        }
    });
    EXPECT_GE(tails_.reached.size(), 5u) << "edges";
}

TEST_P(TailsTest, ColoursReadTheSamplesAlone) {
    for (const int channels : {2, 3, 4})
        each({{17, 9, 1}, {7, 5, 3}}, channels, [&](const Caller& caller) {
            const Representation& what = caller.data->what;
            tails_.try_request(
                "colours", warped(what, Field::linear, rotation(0, 0, 25), Vec3::Zero()), caller);
            tails_.try_request("colours",
                               warped(what, Field::linear, rotation(0, 0, 0), Vec3::Zero(), 0.4),
                               caller);
            tails_.try_request(
                "colours", warped(what, Field::linear, rotation(0, 0, 90), Vec3::Zero()), caller);
            tails_.try_request("colours", seen(Mode::composite, what, rotation(20, 35, -50)),
                               caller);
        });
    EXPECT_GE(tails_.reached.size(), 4u) << "edges";
}

}  // namespace
}  // namespace edgewise
