// A cine: a volume that changes from frame to frame, seen from where the user turns it to. The plan
// is made once; it is cancelled on the way, and goes on.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <memory>
#include <vector>

using namespace edgewise;

namespace {

constexpr int kSide = 48;

/// A ball that beats. The volume shares the vector: nothing is copied.
Volume ball(int frame) {
    auto samples = std::make_shared<std::vector<float>>(kSide * kSide * kSide);
    const double radius = 14 + 3 * std::sin(frame * 0.3);
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
        const double x = i % kSide - 23.5, y = i / kSide % kSide - 23.5,
                     z = i / kSide / kSide - 23.5;
        (*samples)[static_cast<std::size_t>(i)] =
            static_cast<float>(std::clamp(radius - std::sqrt(x * x + y * y + z * z), 0.0, 1.0));
    }
    return Volume::around(samples->data(), {kSide, kSide, kSide}, 3, 1, Type::f32, samples);
}

GeometrySpec turned_by(double degrees) {
    GeometrySpec views;
    views.steps = {{GeometryStep::Kind::rotate, {15, degrees, 0}}};
    views.size = OutputSize{.sides = {96, 96}};
    return views;
}

}  // namespace

int main(int count, char** words) {
    const int frames = count > 1 ? std::atoi(words[1]) : 1000;
    Query query;
    query.mode = Mode::mip;
    query.geometry = turned_by(0);
    query.max_error = 0.05;
    Prepared plan = prepare(default_engine(), query, ball(0));
    const auto pixels = static_cast<std::size_t>(plan.result().extent.samples());
    std::vector<float> picture(pixels);
    RunWith with;
    with.into = std::as_writable_bytes(std::span(picture));

    int seen = 0, cancelled = 0;
    for (int frame = 0; frame < frames; ++frame) {
        plan = plan.with_input(ball(frame).samples());
        if (frame % 50 == 49) plan = plan.with_views(turned_by(frame * 0.36));  // the user turns it
        std::atomic<bool> stop = frame % 100 == 99;  // somebody presses a key
        with.stop = &stop;
        try {
            plan.run(with);
        } catch (const Cancelled&) {
            ++cancelled;
            stop = false;
            plan.run(with);  // and goes on
        }
        seen += *std::max_element(picture.begin(), picture.end()) > 0.9f;
    }
    std::printf("%d frames, cancelled and resumed %d times\n", seen, cancelled);
    return seen == frames && cancelled == frames / 100 ? 0 : 1;
}
