#include "engine/mpr.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "measure/since.hpp"
#include "presentation/coloured.hpp"
#include "presentation/sheet.hpp"
#include "request/make_request.hpp"
#include "request/outputs.hpp"
#include "request/resolution.hpp"

namespace edgewise {
namespace {

constexpr int kBetweenPlanes = 2;  // pixels between planes
constexpr int kLeastSide = 512;    // pixels of a picture whose size nobody says

/// What of the request planes have no use for, or "".
Message useless(const Query& query) {
    const GeometrySpec& geometry = query.geometry;
    if (geometry.view) return setting("view");
    if (!geometry.steps.empty()) return setting_of(geometry.steps.front().kind);
    if (geometry.about) return setting("about");
    if (geometry.perspective) return setting("perspective");
    if (geometry.zoom) return setting("zoom");
    if (!query.clip.empty()) return query.clip.settings();
    if (query.look.montage) return setting("montage");
    if (query.look.depth_colour) return setting("depth_colour");
    return "";
}

class MakingPlanes {
 public:
    MakingPlanes(Planes& planes, const std::function<void(Planned&)>& planned)
        : planes_(planes), query_(planes.query), planned_(planned) {}

    void run_all() {
        look();
        for (const char* view : views_) {
            if (planes_.messages.stop()) throw Cancelled();
            render(view);
        }
        write();
    }

 private:
    void look() {
        if (const Message found = useless(query_); !found.empty())
            throw RequestError(message("{}: not with @mpr, which shows three planes", found));
        outputs_ = outputs_of(query_);
        const InState unobserved(planes_.messages, Listener::State::unobserved);
        const Input input = inspected(query_.input, selection_of(query_));
        if (input.described)
            throw RequestError(message("@mpr: a description has no samples to show"));
        grid_ = grid_of(input);
        if (grid_.axes != 3) throw RequestError(message("@mpr: of volumes; this is an image"));
        for (int axis = 0; axis < 3; ++axis) {
            const double at = planes_.place[static_cast<std::size_t>(axis)];
            const auto most = static_cast<double>(grid_.extent[axis] - 1);
            if (at != std::floor(at) || !(at >= 0 && at <= most))
                throw RequestError(message("@mpr: {} along {}: expected a sample, from 0 to {}", at,
                                           "xyz"[axis], most));
        }
        if (grid_.anatomical) views_ = {"front", "left", "bottom"};
        take_pixel();
    }

    void take_pixel() {
        pixel_ = grid_.spacing.minCoeff();
        const GeometrySpec& geometry = query_.geometry;
        if (geometry.spacing) pixel_ = geometry.spacing->front();
        if (!geometry.size) {
            // Gaps make up for what rounding takes from two planes.
            if (!geometry.spacing) pixel_ = std::min(pixel_, longer_side() / kLeastSide);
            return;
        }
        if (geometry.size->native) return;
        if (geometry.size->fit || geometry.size->sides.size() != 1)
            throw RequestError(
                message("@size: '{}' given; of @mpr expected N, the pixels of the longest side of "
                        "the volume",
                        geometry.size->text()));
        double longest = 0;
        for (int axis = 0; axis < 3; ++axis)
            longest =
                std::max(longest, static_cast<double>(grid_.extent[axis]) * grid_.spacing[axis]);
        pixel_ = longest / static_cast<double>(geometry.size->sides[0]);
    }

    /// Of the picture without its gap [file unit].
    double longer_side() const {
        std::array<Vec3, 3> sides;  // of each plane, along its x, y and away from the eye
        for (std::size_t k = 0; k < sides.size(); ++k)
            sides[k] = view_of(views_[k], grid_.direction).cwiseAbs() *
                       grid_.spacing.cwiseProduct(Vec3(static_cast<double>(grid_.extent.x),
                                                       static_cast<double>(grid_.extent.y),
                                                       static_cast<double>(grid_.extent.z)));
        return std::max(std::max(sides[0].x(), sides[2].x()) + sides[1].x(),
                        std::max(sides[0].y(), sides[1].y()) + sides[2].y());
    }

    /// One plane, as a warp of the view's grid of which one layer is kept.
    void render(const char* view) {
        const Mat3 turn = view_of(view, grid_.direction);
        int depth = 0;
        for (int axis = 0; axis < 3; ++axis)
            if (turn(2, axis) != 0) depth = axis;
        Query one = query_;
        one.job = Job::warp;
        one.mode = Query().mode;
        one.out.reset();
        one.look = {};
        one.geometry = {};
        one.geometry.view = view;
        one.geometry.spacing = {pixel_, pixel_, grid_.spacing[depth]};
        std::vector<double> box{0, 0, 0};
        for (int axis = 0; axis < 3; ++axis)
            box.push_back(static_cast<double>(grid_.extent[axis] - 1));
        const double at = planes_.place[static_cast<std::size_t>(depth)];
        box[static_cast<std::size_t>(depth)] = box[static_cast<std::size_t>(depth) + 3] = at;
        one.geometry.crop = box;
        Reached& reached =
            planes_.requests.emplace_back(ask(planes_.engine, std::move(one), {.runs = true}));
        const ErrorsWanted errors =
            planes_.explained || query_.verify ? ErrorsWanted::asked : ErrorsWanted::for_choice;
        reached.prepare({.errors = errors, .front = planes_.explained}, planes_.messages);
        if (planned_) planned_(reached.plan());
        const auto keep = [&](int, const Data& result) {
            auto copy =
                std::make_shared<Data>(Data::make(result.what, std::pmr::get_default_resource()));
            std::memcpy(copy->as<std::byte>(), result.as<std::byte>(), result.samples.bytes());
            found_.push_back(std::move(copy));
        };
        reached.run_all({.frames = keep}, planes_.messages);
        reached.planned()->memory->trim();
    }

    const Planned& first() const { return *planes_.requests.front().planned(); }

    void write() {
        if (!outputs_ || outputs_->none()) return;
        const auto begin = std::chrono::steady_clock::now();
        const int channels = found_[0]->what.channels;
        if (channels != 1 && channels != 3)
            throw RequestError(
                message("@mpr: of one channel or of colours, and here are {} channels; @channel N "
                        "takes one",
                        channels));
        Tail tail;
        tail.view = true;
        tail.type = Type::u8;
        tail.channels = channels;
        tail.table = first().input.table;
        const Shades levels = shades_of(found_, query_.window, tail);
        const bool in_colours = channels == 1 && query_.look.colours();
        const Colormap map =
            query_.look.colormap.empty() ? Colormap() : colormap_of(query_.look.colormap);
        const auto samples = [&](const Data& result) {
            return in_colours
                       ? coloured(result, tail, levels, map, std::pmr::get_default_resource())
                       : finished(result, tail, levels, std::pmr::get_default_resource());
        };
        Canvas canvas = arranged(in_colours ? 3 : channels, samples, levels);
        planes_.extent = {canvas.width, canvas.height, 1};
        store::Header header;
        header.volume = false;
        header.extent = planes_.extent;
        header.channels = canvas.channels;
        header.colour = canvas.channels == 3;
        header.type = Type::u8;
        header.spacing = {pixel_, pixel_, 1};
        header.unit = first().input.header.unit;
        header.format = outputs_->format().name;
        Sheet sheet(query_.look, header, 1);
        if (in_colours && query_.look.legend)
            sheet.explain({map, levels.black, levels.white, first().input.header.value_unit});
        sheet.add(0, canvas.samples.data());
        const std::string file = outputs_->file(0);
        if (const std::string why = store::cannot_write(file, sheet.header()); !why.empty())
            throw RequestError(message("@out({}): {}", file, why));
        store::write(file, sheet.header(), sheet.samples(), {query_.quality});
        planes_.files.push_back(file);
        planes_.write_seconds = since(begin);
    }

    template <class Samples>
    Canvas arranged(int channels, const Samples& samples, const Shades& levels) const {
        const auto side = [&](std::size_t plane, int axis) {
            return static_cast<int>(found_[plane]->what.extent[axis]);
        };
        const int left = std::max(side(0, 0), side(2, 0)), above = std::max(side(0, 1), side(1, 1));
        Canvas canvas(left + kBetweenPlanes + side(1, 0), above + kBetweenPlanes + side(2, 1),
                      channels);
        // Where no plane is, it is as the least value is shown.
        if (found_[0]->what.channels == 1 && !first().input.table) {
            Representation what;
            what.type = Type::f32;
            what.extent = {1, 1, 1};
            Data least = Data::make(what, std::pmr::get_default_resource());
            *least.as<float>() = static_cast<float>(std::min(levels.black, levels.white));
            const Array pixel = samples(least);
            canvas.fill({static_cast<const std::uint8_t*>(pixel.data()), pixel.bytes()});
        }
        const std::array<std::array<int, 2>, 3> places{
            {{0, 0}, {left + kBetweenPlanes, 0}, {0, above + kBetweenPlanes}}};
        for (std::size_t k = 0; k < found_.size(); ++k) {
            const Array picture = samples(*found_[k]);
            canvas.put(places[k][0], places[k][1], side(k, 0), side(k, 1),
                       {static_cast<const std::uint8_t*>(picture.data()), picture.bytes()});
        }
        return canvas;
    }

    Planes& planes_;
    const Query& query_;
    const std::function<void(Planned&)>& planned_;
    std::optional<Outputs> outputs_;
    std::array<const char*, 3> views_{"y", "x", "z"};
    InputGrid grid_;
    double pixel_ = 1;  // [file unit]
    std::vector<std::shared_ptr<const Data>> found_;
};

}  // namespace

Planes::Planes(Query request, const std::array<double, 3>& at, Engine means, Listener& listener)
    : query(std::move(request)), place(at), engine(std::move(means)), messages(listener) {}

void perform(Planes& planes, const std::function<void(Planned&)>& planned) {
    MakingPlanes(planes, planned).run_all();
}

}  // namespace edgewise
