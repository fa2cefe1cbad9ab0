#include "engine/request/request_text.hpp"

#include <fmt/format.h>
#include <string>
#include <vector>

#include "graph/filtering.hpp"
#include "graph/hash.hpp"
#include "graph/radon.hpp"
#include "graph/transfer_table.hpp"
#include "surface/lids.hpp"

namespace edgewise {
namespace {

/// A table may have many numbers.
std::string text_of(const TransferTable& table) {
    Hash hash;
    const auto add = [&](const auto& numbers) {
        hash.add(numbers.data(), numbers.size() * sizeof(numbers[0]));
    };
    add(table.values), add(table.gradients), add(table.opacity), add(table.color);
    return fmt::format("table {} {} {:x}", table.values.size(), table.gradients.size(),
                       hash.value());
}

}  // namespace

std::string request_text(const Request& want) {
    std::string text =
        fmt::format("{}|{}|{} {} {}|{}|{:a} {:a} {:a} {:a}|", name_of(want.job), name_of(want.mode),
                    want.axes, text_of(want.screen, 3), want.frames, static_cast<int>(want.field),
                    want.unit, want.zero, want.miss, want.outside);
    for (int view = 0; view < want.frames; ++view) {
        const Mat4 map = want.views.at(view).matrix();
        text.append(reinterpret_cast<const char*>(map.data()), 16 * sizeof(double));
    }
    for (int i = 0; i < 3; ++i)
        text += fmt::format("{:a} {:a},", want.spacing[i], want.background[i]);
    if (want.keeps_alpha) text += "alpha ";
    if (want.eye)
        text += fmt::format("eye {:a} {:a} {:a} {:a} {:a} {:a}", want.eye->at[0], want.eye->at[1],
                            want.eye->at[2], want.eye->plane, want.eye->width, want.eye->height);
    for (const Clip& clip : want.clips) {
        text += "clip";
        for (const HalfSpace& plane : half_spaces_of(clip))
            text += fmt::format(" {:a} {:a} {:a} {:a}", plane.normal[0], plane.normal[1],
                                plane.normal[2], plane.offset);
        for (const Ball& ball : clip.balls) {
            text +=
                fmt::format(" ball {:a} {:a} {:a}", ball.centre[0], ball.centre[1], ball.centre[2]);
            for (int i = 0; i < 9; ++i) text += fmt::format(" {:a}", ball.to_unit(i / 3, i % 3));
        }
    }
    if (want.written)
        text += fmt::format("written {} {:a} {:a} {} {:a}", name_of(want.written->type),
                            want.written->values.slope, want.written->values.offset,
                            want.written->straight, want.written->opaque);
    if (want.range) text += fmt::format("range {:a}", *want.range);
    text += fmt::format("{:a}", want.transfer.unit);
    for (const auto& point : want.transfer.points)
        text += fmt::format("{:a} {:a} {:a} {:a} {:a};", point.value, point.opacity, point.color[0],
                            point.color[1], point.color[2]);
    for (const Transfer::Edge& edge : want.transfer.edges)
        text += fmt::format("edge {:a} {:a};", edge.magnitude, edge.opacity);
    if (want.transfer.table) text += text_of(*want.transfer.table);
    if (want.surface)
        text += want.surface->isovalue ? fmt::format("surface {:a}", *want.surface->isovalue)
                                       : "surface of labels";
    if (const auto* setting = want.setting.as<surface::MeshSetting>())
        text += setting->lids ? " closed" : "";
    if (const Filtering* filtering = want.setting.as<Filtering>()) {
        const Stencil& stencil = filtering->stencil;
        text += fmt::format("filter {} {} {}", name_of(filtering->op), name_of(filtering->border),
                            text_of(stencil.extent, 3));
        text.append(reinterpret_cast<const char*>(stencil.weights.data()),
                    stencil.weights.size() * sizeof(double));
        for (const Stencil& one : filtering->derivatives) {
            text += fmt::format("derivative {}", text_of(one.extent, 3));
            text.append(reinterpret_cast<const char*>(one.weights.data()),
                        one.weights.size() * sizeof(double));
        }
        if (is_binary(filtering->op)) text += fmt::format("inside {:a}", filtering->inside);
    }
    if (const RadonSetting* radon = want.setting.as<RadonSetting>()) {
        text += fmt::format("radon {} {} {:a}", radon->angles, static_cast<int>(radon->to),
                            radon->threshold);
        for (const double degrees : radon->degrees) text += fmt::format(" {:a}", degrees);
    }
    if (want.cue) text += fmt::format("cue {:a} {}", want.cue->per_length, want.cue->linear);
    if (want.smooths_gradients()) text += "sobel";
    const Shading& shading = want.shading;
    if (!shading.on()) return text;
    const Material& m = shading.material;
    text += fmt::format("shade {} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {:a}",
                        static_cast<int>(shading.by), m.ambient, m.diffuse, m.specular, m.exponent,
                        shading.least, shading.phase, want.pixel[0], want.pixel[1]);
    text += fmt::format("{} {:a}", shading.shadows, shading.occlusion);
    for (const Light& light : shading.lights)
        text += fmt::format("light {:a} {:a} {:a} {:a}", light.towards[0], light.towards[1],
                            light.towards[2], light.intensity);
    return text;
}

}  // namespace edgewise
