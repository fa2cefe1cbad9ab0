// OpenImageIO's buffers and our data share their samples, for as long as anyone needs them.
#include "io/image_buf.hpp"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagecache.h>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

#include "graph/errors.hpp"
#include "planner/planner.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::store {
namespace {

using Image = OIIO::ImageBuf;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

constexpr Extent kSize{19, 17, 13};

ImageSpec spec_of(const Extent& n, int channels, TypeDesc type) {
    ImageSpec spec(static_cast<int>(n.x), static_cast<int>(n.y), channels, type);
    spec.depth = spec.full_depth = static_cast<int>(n.z);
    return spec;
}

/// Values that each type can hold, the same in every buffer.
float value_at(int x, int y, int z, int c) {
    return static_cast<float>((31 * x + 17 * y + 11 * z + 7 * c) % 100);
}

void fill(Image& image) {
    const ImageSpec& spec = image.spec();
    const float whole = spec.format == TypeDesc::FLOAT ? 1 : 255;
    std::vector<float> pixel(static_cast<std::size_t>(spec.nchannels));
    for (int z = 0; z < spec.depth; ++z)
        for (int y = 0; y < spec.height; ++y)
            for (int x = 0; x < spec.width; ++x) {
                for (int c = 0; c < spec.nchannels; ++c) pixel[c] = value_at(x, y, z, c) / whole;
                image.setpixel(x, y, z, pixel.data());
            }
}

std::string refusal(std::shared_ptr<const Image> image) {
    try {
        data_of(std::move(image));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

/// In memory of its own. Where that ends near the end of its page, which is a matter of chance,
/// data_of refuses, so the next piece of memory is taken.
std::shared_ptr<Image> filled(const Extent& n, int channels, TypeDesc type) {
    std::vector<std::shared_ptr<Image>> refused;
    for (;;) {
        auto image = std::make_shared<Image>(spec_of(n, channels, type));
        fill(*image);
        if (refusal(image).find("page of memory") == std::string::npos) return image;
        refused.push_back(std::move(image));
    }
}

/// The same samples in an array of ours.
std::shared_ptr<const Data> copy_of(const Data& data, MemoryBudget& memory) {
    auto copy = std::make_shared<Data>(Data::make(data.what, &memory));
    copy_box(data, *copy);
    return copy;
}

TEST(ImageBuf, PixelsAreSharedAsData) {
    const std::pair<TypeDesc::BASETYPE, Type> types[] = {{TypeDesc::UINT8, Type::u8},
                                                         {TypeDesc::INT8, Type::i8},
                                                         {TypeDesc::UINT16, Type::u16},
                                                         {TypeDesc::INT16, Type::i16},
                                                         {TypeDesc::FLOAT, Type::f32}};
    for (const auto& [base, type] : types)
        for (const Extent& n : {kSize, Extent{19, 17, 1}})
            for (int channels = 1; channels <= 4; ++channels) {
                const auto image = filled(n, channels, base);
                const auto data = data_of(image);
                EXPECT_EQ(data->samples.data(), image->localpixels());
                EXPECT_EQ(data->what.type, type);
                EXPECT_EQ(data->what.extent, n);
                EXPECT_EQ(data->what.axes, n.z > 1 ? 3 : 2);
                EXPECT_EQ(data->what.channels, channels);
                EXPECT_EQ(data->samples.bytes(), static_cast<std::size_t>(data->what.bytes()));
                const char* last = static_cast<const char*>(
                    image->pixeladdr(int(n.x) - 1, int(n.y) - 1, int(n.z) - 1, channels - 1));
                EXPECT_EQ(last, data->as<char>() + data->samples.bytes() - bytes_of(type));
            }
    const auto image = filled(kSize, 2, TypeDesc::FLOAT);
    const auto data = data_of(image);
    EXPECT_EQ(data->at<float>(3, 5, 7)[1], value_at(3, 5, 7, 1));
}

TEST(ImageBuf, LivesAsLongAsAnyThatSharesIt) {
    std::weak_ptr<Image> alive;
    Data shared;
    {
        std::shared_ptr<const Data> data;
        {
            auto image = filled(kSize, 1, TypeDesc::FLOAT);
            alive = image;
            data = data_of(std::move(image));
        }
        ASSERT_FALSE(alive.expired());
        shared = Data::sharing(*data, data->what);
    }
    ASSERT_FALSE(alive.expired());
    EXPECT_EQ(*shared.at<float>(1, 2, 3), value_at(1, 2, 3, 0));
    shared = Data();
    EXPECT_TRUE(alive.expired());
}

TEST(ImageBuf, NotANumberIsASample) {
    auto image = filled({8, 8, 1}, 1, TypeDesc::FLOAT);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    image->setpixel(2, 3, &nan);
    EXPECT_TRUE(std::isnan(*data_of(image)->at<float>(2, 3, 0)));
}

TEST(ImageBuf, RefusalsSayWhy) {
    EXPECT_NE(refusal(nullptr).find("none"), std::string::npos);
    EXPECT_NE(refusal(std::make_shared<Image>()).find("no pixels"), std::string::npos);
    for (const auto type : {TypeDesc::HALF, TypeDesc::DOUBLE, TypeDesc::UINT32})
        EXPECT_NE(refusal(std::make_shared<Image>(spec_of(kSize, 1, type))).find("its samples are"),
                  std::string::npos);
    EXPECT_NE(refusal(filled(kSize, 5, TypeDesc::UINT8)).find("5 channels"), std::string::npos);

    ImageSpec deep = spec_of({8, 8, 1}, 1, TypeDesc::FLOAT);
    deep.deep = true;
    EXPECT_NE(refusal(std::make_shared<Image>(deep)).find("deep"), std::string::npos);
}

TEST(ImageBuf, PixelsThatDoNotLieSideBySideAreCopied) {
    std::vector<char> bytes(4096 * sizeof(float) + 1);
    const ImageSpec small = spec_of({8, 6, 1}, 1, TypeDesc::FLOAT);
    const auto expect_copy = [&](char* at, OIIO::stride_t pixel, OIIO::stride_t row) {
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 8; ++x) {
                const auto value = static_cast<float>(10 * y + x);
                std::memcpy(at + y * row + x * pixel, &value, sizeof value);
            }
        const auto data = data_of(std::make_shared<Image>(small, at, pixel, row));
        EXPECT_NE(static_cast<const void*>(at), data->samples.data());
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 8; ++x) EXPECT_EQ(data->as<float>()[8 * y + x], 10 * y + x);
    };
    expect_copy(bytes.data(), 4, 48);          // room behind rows
    expect_copy(bytes.data() + 2048, 4, -32);  // upside down
    expect_copy(bytes.data(), 12, 96);         // one channel of three
    expect_copy(bytes.data() + 1, 4, 32);      // between two addresses
    const auto shared =
        data_of(std::make_shared<Image>(small, bytes.data(), OIIO::AutoStride, OIIO::AutoStride));
    EXPECT_EQ(shared->samples.data(), bytes.data());
}

TEST(ImageBuf, PixelsInACacheAreRefused) {
    const char* scratch = std::getenv("EDGEWISE_SCRATCH");
    const std::string path = (scratch ? std::string(scratch) : "/tmp") + "/image_buf_" +
                             std::to_string(::getpid()) + ".tif";
    ASSERT_TRUE(filled({64, 64, 1}, 3, TypeDesc::UINT8)->write(path));
    OIIO::ImageCache* const cache = OIIO::ImageCache::create(false);
    auto cached = std::make_shared<Image>(path, 0, 0, cache);
    EXPECT_NE(refusal(cached).find("in a cache"), std::string::npos);
    ASSERT_TRUE(cached->read(0, 0, true));
    EXPECT_EQ(data_of(cached)->samples.data(), cached->localpixels());
    cached.reset();
    OIIO::ImageCache::destroy(cache);
    EXPECT_NE(refusal(std::make_shared<Image>(path + ".absent")), "");
    ::unlink(path.c_str());
}

TEST(ImageBuf, SamplesMayEndWhereTheirPageDoes) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    void* const mapped =
        mmap(nullptr, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(mapped, MAP_FAILED);
    mprotect(static_cast<char*>(mapped) + page, page, PROT_NONE);
    const ImageSpec small = spec_of({8, 8, 1}, 1, TypeDesc::UINT8);  // 64 bytes
    for (const std::size_t before : {std::size_t{0}, kArraySlack - 1, kArraySlack}) {
        char* const at = static_cast<char*>(mapped) + page - before - 64;
        const auto data = data_of(std::make_shared<Image>(small, at));
        EXPECT_EQ(data->samples.data(), at) << "no copy";
        EXPECT_FALSE(data->samples.has_slack());
        const Data read = with_slack(*data, std::pmr::new_delete_resource());
        EXPECT_EQ(0, std::memcmp(read.samples.data(), at, 64));
    }
    munmap(mapped, 2 * page);
}

TEST(ImageBuf, DataIsWrappedAndKept) {
    MemoryBudget memory(std::size_t{1} << 24);
    std::shared_ptr<const Image> image;
    {
        Representation what;
        what.extent = kSize;
        what.channels = 3;
        what.type = Type::u16;
        auto data = std::make_shared<Data>(Data::make(what, &memory));
        const auto writable = image_buf_of(data);
        EXPECT_EQ(writable->localpixels(), data->samples.data());
        fill(*writable);
        EXPECT_EQ(data->at<std::uint16_t>(3, 5, 7)[1],
                  std::lround(value_at(3, 5, 7, 1) / 255 * 65535));
        image = image_buf_of(std::shared_ptr<const Data>(data));
        EXPECT_EQ(image->localpixels(), data->samples.data());
        EXPECT_EQ(data_of(image)->samples.data(), data->samples.data()) << "there and back";
    }
    EXPECT_GT(memory.used(), 0u);
    EXPECT_EQ(image->spec().depth, kSize.z);
    EXPECT_NEAR(image->getchannel(3, 5, 7, 1), value_at(3, 5, 7, 1) / 255, 1e-4);
    image.reset();
    EXPECT_EQ(memory.used(), 0u);
}

TEST(ImageBuf, ABoxIsTheDataWindow) {
    MemoryBudget memory(std::size_t{1} << 24);
    Representation what;
    what.extent = kSize;
    const auto box =
        std::make_shared<Data>(Data::make(what, Region{{2, 3, 4}, {8, 9, 10}}, &memory));
    const auto image = image_buf_of(box);
    *box->at<float>(5, 6, 7) = 42;
    EXPECT_EQ(image->getchannel(5, 6, 7, 0), 42);
    EXPECT_EQ(image->roi(), OIIO::ROI(2, 8, 3, 9, 4, 10, 0, 1));
    EXPECT_EQ(image->roi_full(), OIIO::ROI(0, 19, 0, 17, 0, 13, 0, 1));
    what.layout = Layout::bricked;
    const auto bricks = std::make_shared<Data>(Data::make(what, &memory));
    EXPECT_THROW(image_buf_of(bricks), InputError);
}

/// Bytes of the result, of samples that OpenImageIO holds and of a copy that we do.
void expect_same_bytes(Job job, std::shared_ptr<const Image> image) {
    MemoryBudget memory(std::size_t{1} << 28);
    const auto data = data_of(std::move(image));
    const Request want =
        request_of(job, Mode::mip, data->what,
                   {data->what.axes == 3 ? rotation(25, -40, 10) : rotation(0, 0, 30)});
    std::vector<std::vector<char>> results;
    for (const auto& input : {data, copy_of(*data, memory)}) {
        const std::size_t before = memory.used();
        const Scene scene = scene_of(*input, want, memory);
        const Ask ask{want, scene};
        const Answer answer = plan(catalogue(), ask, {{input->what}}, default_profile(catalogue()));
        ASSERT_TRUE(answer.plan) << answer.problem;
        const auto result = results_of(*answer.plan, ask, input, 2, memory);
        const char* bytes = result.front()->as<char>();
        results.emplace_back(bytes, bytes + result.front()->samples.bytes());
        // A result goes out like it came in.
        EXPECT_EQ(image_buf_of(result.front())->localpixels(), bytes);
        EXPECT_GT(memory.used(), before);
    }
    EXPECT_EQ(results[0], results[1]);
    EXPECT_EQ(memory.used(), 0u) << "what is not its own was counted or given back";
}

TEST(ImageBuf, EdgesComputeTheSameBytes) {
    for (const auto type :
         {TypeDesc::UINT8, TypeDesc::INT8, TypeDesc::UINT16, TypeDesc::INT16, TypeDesc::FLOAT}) {
        SCOPED_TRACE(TypeDesc(type).c_str());
        expect_same_bytes(Job::warp, filled(kSize, 1, type));
        expect_same_bytes(Job::render, filled(kSize, 1, type));
        for (int channels : {3, 4})
            expect_same_bytes(Job::warp, filled({37, 23, 1}, channels, type));
    }
}

}  // namespace
}  // namespace edgewise::store
