// CT: an image from its X-rays in many directions, by filtered backprojection or by way of its
// spectrum, of which the spectra of X-rays are lines (Fourier slice theorem).
//
//   ct/lines --convolve--------------> ct/filtered --backproject--> ct/image
//       \--transform--> ct/spectra --ramp--^                           ^
//                           \--to_grid--> ct/spectrum --invert---------/
#include "own_graph.hpp"
#include "tomography.hpp"
#include "transitions/catalogue.hpp"

using namespace edgewise;
using namespace edgewise::tomography;

constexpr JobTraits kReconstruct{.name = "reconstruct", .target = "ct/image"};

/// RMS of the errors of all blobs, of which each one's sum of squares is known.
Error of_blobs(double (*squares)(const Blob&)) {
    double sum = 0;
    for (const Blob& blob : kBlobs) sum += squares(blob) * blob.height * blob.height * kPi;
    return {.bias = std::sqrt(sum) / kSide};
}

int main() {
    const Kind lines{"ct", "lines", {kLine, kAngles, 1}}, filtered{"ct", "filtered", lines.extent},
        spectra{"ct", "spectra", {kHalf, kAngles, 1}, Type::c64},
        spectrum{"ct", "spectrum", {kColumns, kGrid, 1}, Type::c64},
        image{"ct", "image", {kSide, kSide, 1}};

    // Linear interpolation adds 1/12 of the second derivative in the mean: of lines it blurs the
    // image, of spectra the image fades away from its centre (here of blobs that lie there).
    const Error blurred = of_blobs([](const Blob& b) { return 2 / std::pow(12 * b.width, 2); });
    const Error faded = of_blobs(
        [](const Blob& b) { return std::pow(b.width, 6) * std::pow(kPi / kPeriod, 4) / 9; });
    // The ramp of a spectrum has nothing at frequency 0, where that of samples has a little.
    double mass = 0;
    for (const Blob& b : kBlobs) mass += b.height * 2 * kPi * b.width * b.width;
    const Error lowered{.bias = kPi * mass / (6.0 * kPeriod * kPeriod)};

    // Operations that no vector does take as long as eight; an arctangent and a root 350 of these.
    constexpr double kAlone = 8, kTaps = 0.5 * kLine * kLine * kAngles;
    constexpr double kSums = 1.0 * kSide * kSide * kAngles, kPoints = 1.0 * kGrid * kColumns;
    const Work row{.operations = kAngles * kernels::fourier_operations(kPeriod) / 2};
    const Work taps{.operations = 5 * kAlone * kTaps};
    const Work sums{.operations = 12 * kAlone * kSums, .gathers = 2 * kSums};
    const Work points{.operations = 350 * kAlone * kPoints, .gathers = 4 * kPoints};
    const Work plane{.operations = kGrid * kernels::fourier_operations(kGrid)};
    Catalogue edges = catalogue();
    edges.push_back(plain_edge("ct.convolve", "ct/lines", filtered, taps, {}, convolve));
    edges.push_back(plain_edge("ct.transform", "ct/lines", spectra, row, {}, transform));
    edges.push_back(plain_edge("ct.ramp", "ct/spectra", filtered, row, lowered, ramp));
    edges.push_back(plain_edge("ct.backproject", "ct/filtered", image, sums, blurred, backproject));
    edges.push_back(plain_edge("ct.to_grid", "ct/spectra", spectrum, points, faded, to_grid));
    edges.push_back(plain_edge("ct.invert", "ct/spectrum", image, plane, {}, invert));

    MemoryBudget memory(std::size_t{64} << 20);
    const auto sinogram = data_of(lines, memory);
    for (int i = 0; i < kLine * kAngles; ++i) {
        double sum = 0;
        for (const Blob& blob : kBlobs)
            sum += blob.line(kPi * (i / kLine) / kAngles, i % kLine - kLine / 2);
        sinogram->as<float>()[i] = float(sum);
    }
    std::vector<double> phantom(kSide * kSide);
    for (int i = 0; i < kSide * kSide; ++i)
        for (const Blob& blob : kBlobs)
            phantom[i] += blob.image(i % kSide - kSide / 2, i / kSide - kSide / 2);
    const Job job(kReconstruct);
    const bool close = are_right({edges, job, sinogram, phantom, 0.00008, memory}, {{}});
    return !close || !are_right({edges, job, sinogram, phantom, 0.001, memory},
                                {{}, {"ct.convolve"}, {"ct.ramp"}, {"ct.to_grid"}});
}
