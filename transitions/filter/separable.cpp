#include "transitions/filter/separable.hpp"

#include <cmath>
#include <fmt/format.h>

#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

/// The weights of a line that are not 0, and where they are.
template <class T>
struct Line {
    SmallVector<std::ptrdiff_t> places;
    SmallVector<T> weights;

    Line(const SmallVector<double>& all, std::int64_t step) {
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (all[i] == 0) continue;
            places.push_back(static_cast<std::ptrdiff_t>(i) * step);
            weights.push_back(static_cast<T>(all[i]));
        }
    }
    void sum(const T* in, bool adds, T* out, std::int64_t n) const {
        kernels::sum_row(in, places.data(), weights.data(), places.size(), adds, out, n);
    }
};

double weights_in(const SmallVector<double>& line) {
    double count = 0;
    for (const double weight : line) count += weight != 0;
    return count;
}

/// Operations a sample, of vectors alone.
double operations_of(const PassAsk& ask, const SmallVector<Product>& products) {
    const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
    const Extent reach = ask.of.extent();
    const double rows = 1 + double(reach.y - 1) / double(tile.y),
                 slices = 1 + double(reach.z - 1) / double(tile.z);
    const bool is_deep = reach.z > 1;
    double all = 0;
    for (const Product& product : products)
        all += 2 * (weights_in(product.along[0]) * rows * slices +
                    weights_in(product.along[1]) * slices +
                    (is_deep ? weights_in(product.along[2]) : 0));
    return all;
}

std::string not_separable(const PassAsk& ask) {
    if (!ask.of.of_sum()) return "extremes and medians are no sums of products";
    const auto places = static_cast<double>(ask.of.places());
    const auto found = products_of(ask.of, places);
    if (!found)
        return fmt::format(
            "products of rows and columns have more weights than the {:.0f} places "
            "of the kernel",
            places);
    const SmallVector<Product>& products = *found;
    const double operations = operations_of(ask, products);
    if (operations >= 2 * places)
        return fmt::format(
            "{} products of rows and columns take {:.0f} operations a sample, the "
            "kernel itself {:.0f}",
            products.size(), operations, 2 * places);
    if (products.size() > 1 && ask.scene.non_finite > 0)
        return fmt::format(
            "{} values are not finite, and {} products would carry them into holes "
            "of the kernel",
            ask.scene.non_finite, products.size());
    return {};
}

template <class T>
void run_separable(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const SmallVector<Product> products = products_of(run.of).value();
    const Extent reach = run.of.extent();
    const auto work = [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        // Rows of all padded lines, then columns of all padded slices.
        const std::int64_t rows = n.y + reach.y - 1, slices = n.z + reach.z - 1;
        const std::int64_t row = shape.row, row_slice = row * rows, column_slice = row * n.y;
        kernels::Block<T> in_rows(static_cast<std::size_t>(row_slice * slices), tile.memory);
        kernels::Block<T> in_columns(static_cast<std::size_t>(column_slice * slices), tile.memory);
        const T* first = tile.first(run.of);
        bool adds = false;
        for (const Product& product : products) {
            // Of an image the last factor is one number.
            SmallVector<double> along_y = product.along[1];
            if (reach.z == 1)
                for (double& weight : along_y) weight *= product.along[2][0];
            const Line<T> x(product.along[0], 1), y(along_y, row),
                z(product.along[2], column_slice);
            for (std::int64_t k = 0; k < slices; ++k)
                for (std::int64_t j = 0; j < rows; ++j)
                    x.sum(first + j * tile.shape.row + k * tile.shape.slice, false,
                          in_rows.data() + j * row + k * row_slice, n.x);
            for (std::int64_t k = 0; k < slices; ++k)
                for (std::int64_t j = 0; j < n.y; ++j) {
                    const T* from = in_rows.data() + j * row + k * row_slice;
                    if (reach.z == 1)
                        y.sum(from, adds, tile.out_row(j, k), n.x);
                    else
                        y.sum(from, false, in_columns.data() + j * row + k * column_slice, n.x);
                }
            for (std::int64_t k = 0; reach.z > 1 && k < n.z; ++k)
                for (std::int64_t j = 0; j < n.y; ++j)
                    z.sum(in_columns.data() + j * row + k * column_slice, adds, tile.out_row(j, k),
                          n.x);
            adds = true;
        }
        // A kernel of zeros has no product.
        for (std::int64_t k = 0; products.empty() && k < n.z; ++k)
            for (std::int64_t j = 0; j < n.y; ++j) std::fill_n(tile.out_row(j, k), n.x, T{});
    };
    run_tiles<T>(run, shape, work, TileReads::in_place_but_frames);
}

}  // namespace

Transition filter_separable() {
    return filtering_edge({
        .name = "filter.separable",
        .source = "[W93] EQ 6; Bebendorf 2000",
        .refused = not_separable,
        .operations =
            [](const PassAsk& ask) {
                const SmallVector<Product> products = products_of(ask.of).value();
                const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
                const Extent reach = ask.of.extent();
                const double slices = 1 + double(reach.z - 1) / double(tile.z),
                             rows = slices * (1 + double(reach.y - 1) / double(tile.y));
                const double calls = rows + slices + (reach.z > 1 ? 1 : 0);
                return operations_of(ask, products) +
                       ask.call(tile.x) * calls * double(products.size());
            },
        .in_place = true,
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_separable<double>(run);
                else
                    run_separable<float>(run);
            },
        .trials = sum_and_extreme_trials,
        .factors = {{"", 0.9}},
    });
}

}  // namespace edgewise
