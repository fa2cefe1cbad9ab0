// Plans once and runs many frames: a maximum intensity projection, turned by 30 degrees a frame.
#include <cstdio>
#include <string>

#include "engine/session.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

int main(int count, char** words) {
    using namespace edgewise;
    RequestSpec spec;
    spec.input = count > 1 ? words[1] : "phantom:gaussians:64";  // or a NIfTI, NRRD, DICOM file
    spec.mode = Mode::mip;
    spec.geometry.steps = {{GeometryStep::Kind::rotate, {20, 0, 0}},
                           {GeometryStep::Kind::turntable, {12}}};
    spec.max_error = 0.02;  // NRMSE; or max_time [s], or both

    Listener listener;  // derive from it to hear warnings and progress, or to stop
    Session session(spec, catalogue(), default_profile(), listener);
    session.runs = true;
    take_request(session);  // reads the input
    make_plan(session);     // throws NoPlan, saying which budgets would do

    for (const std::string& step : session.answer->plan->texts()) std::printf("%s  ", step.c_str());
    std::printf("predicted: %.2g s, error %.2g\n", session.answer->plan->predicted.seconds,
                session.answer->plan->predicted.error);
    int frames = 0;
    perform(session, [&](int, const Data& picture) {
        const Extent size = picture.what.extent;  // f32, row by row
        frames += picture.as<float>()[(size.y / 2) * size.x + size.x / 2] > 0;
    });
    std::printf("%d frames in %.2g s\n", frames, session.measured->seconds[0]);
    return frames == 12 ? 0 : 1;
}
