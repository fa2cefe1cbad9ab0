// Two channels of a volume in one picture: each by a plan of its own, green and magenta added up.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "engine/merge.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

namespace {

/// Two balls beside each other, one a channel.
void write_balls(const std::string& file) {
    edgewise::store::Header what;
    what.extent = {32, 24, 16};
    what.channels = 2;
    what.type = edgewise::Type::f32;
    std::vector<float> samples;
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 24; ++y)
            for (int x = 0; x < 32; ++x)
                for (const int centre : {10, 22})
                    samples.push_back(
                        float(std::exp(-0.05 * (std::pow(x - centre, 2) + std::pow(y - 12, 2) +
                                                std::pow(z - 8, 2)))));
    edgewise::store::write(file, what, samples.data());
}

}  // namespace

int main(int count, char** words) {
    using namespace edgewise;
    const std::string balls =
        (std::filesystem::temp_directory_path() / "edgewise_example_balls.nrrd").string();
    Query query;
    query.input = count > 1 ? words[1] : balls;  // or an OME-TIFF, a hyperstack of ImageJ
    if (count == 1) write_balls(balls);

    Listener listener;
    Merge merge(query, {{0, store::Colour{0, 1, 0}}, {1, store::Colour{1, 0, 1}}},
                Engine(catalogue(), default_profile(catalogue())), listener);
    merge.runs = true;
    float brightest[3] = {0, 0, 0};
    perform(merge, {}, [&](int, const Data& picture) {  // f32: red, green, blue from 0 to 1
        for (std::int64_t i = 0; i < 3 * picture.what.samples(); ++i)
            brightest[i % 3] = std::max(brightest[i % 3], picture.as<float>()[i]);
    });
    for (const MergedChannel& channel : merge.channels)
        std::printf("channel %d in %s by %s\n", channel.channel,
                    store::text_of(channel.colour).c_str(),
                    channel.request->run->measured.steps.at(0).c_str());
    std::filesystem::remove(balls);
    return brightest[0] == 1 && brightest[1] == 1 && brightest[2] == 1 ? 0 : 1;
}
