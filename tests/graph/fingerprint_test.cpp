#include "graph/fingerprint.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "graph/request_fields.hpp"

namespace edgewise {
namespace {

std::string of_bytes(const std::vector<unsigned char>& bytes) {
    Fingerprint print;
    print.bytes(bytes.data(), bytes.size());
    return print.text();
}

TEST(Fingerprint, EveryByteCountsAndSoDoesTheirNumber) {
    std::mt19937 random(1);
    for (const std::size_t size : {0, 1, 7, 8, 9, 63, 64, 127, 128, 129, 160, 1000}) {
        std::vector<unsigned char> bytes(size);
        for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(random());
        const std::string whole = of_bytes(bytes);
        EXPECT_EQ(whole, of_bytes(bytes));
        std::set<std::string> all{whole};
        for (std::size_t i = 0; i < size; ++i) {
            bytes[i] ^= 1;
            all.insert(of_bytes(bytes));
            bytes[i] ^= 1;
        }
        EXPECT_EQ(all.size(), size + 1);
        bytes.push_back(0);
        EXPECT_NE(of_bytes(bytes), whole);
    }
}

TEST(Fingerprint, WordsThatChangePlacesAreOthers) {
    std::vector<unsigned char> bytes(512);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(i / 8);
    const std::string before = of_bytes(bytes);
    for (std::size_t other = 8; other < bytes.size(); other += 8) {
        std::swap_ranges(bytes.begin(), bytes.begin() + 8, bytes.begin() + std::ptrdiff_t(other));
        EXPECT_NE(of_bytes(bytes), before) << other;
        std::swap_ranges(bytes.begin(), bytes.begin() + 8, bytes.begin() + std::ptrdiff_t(other));
    }
}

/// Changes the number at a place of a walk over all numbers and words of a request.
struct OneChanged {
    int left;  // numbers before it
    bool done = false;

    template <class T>
    void operator()(std::string_view, T& value) {
        if constexpr (std::is_same_v<T, bool>) {
            if (left-- == 0) value = !value, done = true;
        } else if constexpr (std::is_enum_v<T>) {
            if (left-- == 0) value = static_cast<T>(static_cast<int>(value) + 1), done = true;
        } else if constexpr (std::is_arithmetic_v<T>) {
            if (left-- == 0) value = value + 1, done = true;
        } else if constexpr (OfEigen<T>) {
            for (Eigen::Index i = 0; i < value.size(); ++i)
                if (left-- == 0) value.data()[i] += 1, done = true;
        } else if constexpr (HasFields<T>) {
            visit_fields(value, *this);
        } else if constexpr (requires { value.reset(), value.value(); }) {
            if (value) (*this)("", *value);
        } else if constexpr (std::is_same_v<T, std::string>) {
            if (left-- == 0) value += "x", done = true;
        } else if constexpr (requires { value.begin(), value[0]; }) {
            for (auto& each : value) (*this)("", each);
        }
    }
};

TEST(Fingerprint, EveryNumberOfARequestCounts) {
    Request want;
    want.eye.emplace();
    Clip& clip = want.clips.emplace_back();
    clip.low = clip.high = clip.least = clip.most = Vec3::Zero();
    clip.planes.emplace_back(), clip.balls.emplace_back();
    want.transfer.points = {{}, {}};
    want.transfer.edges = {{}};
    want.surface = SurfaceOf{0.5};
    want.cue.emplace(), want.written.emplace(), want.range = 1;
    want.budget = {.error = 1, .seconds = 1, .bytes = 1, .like = Like{.step = 1}};
    const auto print_of = [](const Request& request) {
        Fingerprint print;
        print.add(request);
        return print.text();
    };
    std::set<std::string> all{print_of(want)};
    int numbers = 0;
    for (;; ++numbers) {
        Request other = want;
        OneChanged change{numbers};
        visit_fields(other, [&](std::string_view name, auto& value) { change(name, value); });
        if (!change.done) break;
        EXPECT_TRUE(all.insert(print_of(other)).second) << numbers;
    }
    EXPECT_GT(numbers, 100);
}

}  // namespace
}  // namespace edgewise
