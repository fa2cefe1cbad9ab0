#include "graph/representation.hpp"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <map>

namespace edgewise {
namespace {

constexpr double kSameMap = 1e-9;  // two views share data where all entries agree to this

template <class T>
void append(std::string& key, const T& value) {
    key.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string joined(const std::set<std::string>& facets) {
    std::string text;
    for (const std::string& facet : facets) text += "+" + facet;
    return text;
}

const char* name_of(Layout layout) {
    constexpr const char* kNames[] = {"linear", "bricked", "columns", "slice-and-dice"};
    return kNames[static_cast<int>(layout)];
}

}  // namespace

Placement::Placement(const Transform& map) {
    // Most samples are where they were, and one placement says so for all of them. To the bit: a
    // map with a zero of the other sign is another.
    static const Mat4 kIdentity = Mat4::Identity();
    static const auto& in_place = *new std::shared_ptr<const State>(  // outlives static objects
        std::make_shared<const State>(State{{Transform(kIdentity)}, {}, {0}}));
    const Mat4* matrix = map.as_matrix();
    const bool stays = matrix && std::memcmp(matrix->data(), kIdentity.data(), sizeof(Mat4)) == 0;
    state_ = stays ? in_place : std::make_shared<const State>(State{{map}, {}, {0}});
}

Placement Placement::each(std::vector<Transform> maps) {
    auto state = std::make_shared<State>();
    std::map<std::vector<std::int64_t>, int> seen;
    for (std::size_t view = 0; view < maps.size(); ++view) {
        const auto [found, fresh] = seen.try_emplace(maps[view].key(kSameMap), seen.size());
        if (fresh) state->first_views.push_back(static_cast<int>(view));
        state->variants.push_back(found->second);
    }
    state->maps = std::move(maps);
    return Placement(std::shared_ptr<const State>(std::move(state)));
}

const Transform& Placement::at(int view) const noexcept {
    return state_->variants.empty() ? state_->maps[0] : state_->maps[view];
}
int Placement::different() const noexcept { return static_cast<int>(state_->first_views.size()); }
int Placement::variant(int view) const noexcept {
    return state_->variants.empty() ? 0 : state_->variants[view];
}
int Placement::first_view(int variant) const noexcept { return state_->first_views[variant]; }
bool Placement::one_a_view() const noexcept { return !state_->variants.empty(); }

double Representation::bytes(const Region& box) const noexcept {
    const auto all = static_cast<double>(samples());
    return all > 0 ? bytes() * static_cast<double>(box.extent().samples()) / all : 0;
}

double Representation::bytes() const noexcept {
    return static_cast<double>(samples()) * channels * static_cast<double>(bytes_of(type));
}

std::string Representation::key() const {
    std::string key = space + '\0' + content + joined(facets) + '\0';
    append(key, axes);
    append(key, extent.x);
    append(key, extent.y);
    append(key, extent.z);
    append(key, channels);
    append(key, type);
    append(key, values.slope);
    append(key, values.offset);
    append(key, layout);
    append(key, place);
    // Two edges that lead to a space of one name promise the same placement of its views.
    if (!placed.one_a_view())
        for (std::int64_t entry : placed.at(0).key(1e-6)) append(key, entry);
    return key;
}

std::string Representation::text() const {
    return fmt::format("{}/{}/{}/{}{}", kind(), edgewise::name_of(type), name_of(layout),
                       text_of(extent, axes), channels > 1 ? fmt::format("x{}ch", channels) : "");
}

std::string Representation::kind() const { return space + "/" + content + joined(facets); }

std::string text_of(const Extent& extent, int axes) {
    return axes == 2 ? fmt::format("{}x{}", extent.x, extent.y)
                     : fmt::format("{}x{}x{}", extent.x, extent.y, extent.z);
}

std::set<std::string> facets_of(std::string_view kind) {
    std::set<std::string> facets;
    for (std::size_t at = kind.find('+'); at != std::string_view::npos;) {
        const std::size_t next = kind.find('+', at + 1);
        facets.emplace(kind.substr(at + 1, next - at - 1));
        at = next;
    }
    return facets;
}

bool takes_kind(std::string_view join, std::string_view kind) {
    if (join.substr(0, join.find('+')) != kind.substr(0, kind.find('+'))) return false;
    if (join.find('+') == join.npos) return true;
    const std::set<std::string> needed = facets_of(join), there = facets_of(kind);
    return std::includes(there.begin(), there.end(), needed.begin(), needed.end());
}

}  // namespace edgewise
