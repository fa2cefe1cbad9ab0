// Reads or writes one picture again and again, by edgewise's own way or by OpenImageIO as the
// module of it would (io/oiio_module.cpp). picture_io.py runs both in turns. Prints a line a run,
// the seconds, and at the end the process's peak of resident memory in KiB.
//
//   read FILE RUNS          write FILE OUT RUNS
//
// Which way it is is decided when it is compiled: BY_OPENIMAGEIO.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#ifdef BY_OPENIMAGEIO
#include <OpenImageIO/imageio.h>
#include <stdexcept>
#else
#include "io/store.hpp"
#endif

namespace {

#ifdef BY_OPENIMAGEIO

struct Picture {
    OIIO::ImageSpec spec;
    std::vector<std::byte> samples;
};

Picture read(const std::string& path) {
    OIIO::ImageSpec wish;
    wish["oiio:UnassociatedAlpha"] = 1;
    const auto input = OIIO::ImageInput::open(path, &wish);
    if (!input) throw std::runtime_error(OIIO::geterror());
    input->threads(1);
    Picture picture{input->spec(), {}};
    picture.samples.resize(picture.spec.image_bytes());
    if (!input->read_image(0, 0, 0, picture.spec.nchannels, picture.spec.format,
                           picture.samples.data()))
        throw std::runtime_error(input->geterror());
    return picture;
}

void write(const std::string& path, const Picture& picture) {
    const auto output = OIIO::ImageOutput::create(path);
    if (!output) throw std::runtime_error(OIIO::geterror());
    output->threads(1);
    OIIO::ImageSpec spec(picture.spec.width, picture.spec.height, picture.spec.nchannels,
                         picture.spec.format);
    // As edgewise writes: JPEG of quality 95, TIFF without compression, PNG by the library's rule.
    if (path.ends_with(".jpg")) spec["Compression"] = "jpeg:95";
    if (path.ends_with(".tif")) spec["Compression"] = "none";
    if (!output->open(path, spec) || !output->write_image(spec.format, picture.samples.data()) ||
        !output->close())
        throw std::runtime_error(output->geterror());
}

#else

namespace store = edgewise::store;
using Picture = store::Loaded;

Picture read(const std::string& path) {
    return store::load(path, {}, std::pmr::new_delete_resource());
}

void write(const std::string& path, const Picture& picture) {
    store::write(path, picture.header, picture.samples.data());
}

#endif

void timed(int runs, const std::function<void()>& run) {
    for (int i = 0; i < runs; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        run();
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
        std::printf("%.6f\n", took.count());
    }
}

void print_peak() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:")) std::printf("peak %s\n", line.c_str() + 6);
}

}  // namespace

int main(int count, char** words) {
    try {
        const std::string verb = count > 1 ? words[1] : "";
        if (verb == "read" && count == 4) {
            timed(std::atoi(words[3]), [&] { read(words[2]); });
        } else if (verb == "write" && count == 5) {
            const Picture picture = read(words[2]);
            timed(std::atoi(words[4]), [&] { write(words[3], picture); });
        } else {
            std::fprintf(stderr, "read FILE RUNS, or write FILE OUT RUNS\n");
            return 2;
        }
        print_peak();
        return 0;
    } catch (const std::exception& error) {
        print_peak();
        std::fprintf(stderr, "%s\n", error.what());
        return 4;
    }
}
