// Plans once and runs many times: a maximum intensity projection, turned by 30 degrees a frame.
#include <cstdio>
#include <edgewise/edgewise.hpp>

int main(int count, char** words) {
    using namespace edgewise;
    Query query;
    query.mode = Mode::mip;
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 0, 0}},
                            {GeometryStep::Kind::turntable, {12}}};
    query.max_error = 0.02;  // NRMSE; or max_time [s], or both

    const Volume volume =  // a NIfTI, NRRD or DICOM file; Volume::around takes samples in memory
        Volume::read(count > 1 ? words[1] : "phantom:gaussians:64");
    const Prepared plan = prepare(default_engine(), query, volume);  // or throws

    for (const std::string& step : plan.plan().texts()) std::printf("%s  ", step.c_str());
    std::printf("predicted: %.2g s, error %.2g\n", plan.plan().predicted.seconds,
                plan.plan().predicted.error);
    int bright = 0;
    const auto see = [&](const Frame& frame) {
        const Extent size = frame.samples.what.extent;  // f32, row by row
        bright += frame.samples.as<float>()[(size.y / 2) * size.x + size.x / 2] > 0;
    };
    plan.run({.on_frame = see});
    std::printf("12 frames in %.2g s\n", plan.run({.on_frame = see}).seconds);  // and once more
    return bright == 24 ? 0 : 1;
}
