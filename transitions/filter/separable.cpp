#include "transitions/filter/separable.hpp"

#include <cmath>
#include <fmt/format.h>
#include <vector>

#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

/// The weights of a line that are not 0, and where they are.
template <class T>
struct Line {
    std::vector<std::ptrdiff_t> places;
    std::vector<T> weights;

    Line(const std::vector<double>& all, std::int64_t step) {
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

double weights_in(const std::vector<double>& line) {
    double count = 0;
    for (const double weight : line) count += weight != 0;
    return count;
}

/// Operations a sample.
double operations_of(const PassAsk& ask, const std::vector<Product>& products) {
    const Extent tile = tile_for(ask.of, ask.from.extent, bytes_of(ask.type));
    const Extent reach = ask.of.extent();
    const double rows = 1 + double(reach.y - 1) / double(tile.y),
                 slices = 1 + double(reach.z - 1) / double(tile.z);
    double all = 0;
    for (const Product& product : products)
        all += 2 * (weights_in(product.along[0]) * rows * slices +
                    weights_in(product.along[1]) * slices + weights_in(product.along[2]));
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
    const std::vector<Product>& products = *found;
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
    const std::vector<Product> products = products_of(run.of).value();
    const Extent reach = run.of.extent();
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        const Extent n = tile.extent;
        // Rows of all padded lines, then columns of all padded slices.
        const std::int64_t rows = n.y + reach.y - 1, slices = n.z + reach.z - 1;
        const std::int64_t row_slice = tile.row * rows, column_slice = tile.row * n.y;
        kernels::Block<T> in_rows(static_cast<std::size_t>(row_slice * slices), tile.memory);
        kernels::Block<T> in_columns(static_cast<std::size_t>(column_slice * slices), tile.memory);
        const T* first = tile.first(run.of);
        bool adds = false;
        for (const Product& product : products) {
            const Line<T> x(product.along[0], 1), y(product.along[1], tile.row),
                z(product.along[2], column_slice);
            for (std::int64_t k = 0; k < slices; ++k)
                for (std::int64_t j = 0; j < rows; ++j)
                    x.sum(first + j * shape.row + k * shape.slice, false,
                          in_rows.data() + j * tile.row + k * row_slice, n.x);
            for (std::int64_t k = 0; k < slices; ++k)
                for (std::int64_t j = 0; j < n.y; ++j)
                    y.sum(in_rows.data() + j * tile.row + k * row_slice, false,
                          in_columns.data() + j * tile.row + k * column_slice, n.x);
            for (std::int64_t k = 0; k < n.z; ++k)
                for (std::int64_t j = 0; j < n.y; ++j)
                    z.sum(in_columns.data() + j * tile.row + k * column_slice, adds,
                          tile.out_row(j, k), n.x);
            adds = true;
        }
        // A kernel of zeros has no product.
        for (std::int64_t k = 0; products.empty() && k < n.z; ++k)
            for (std::int64_t j = 0; j < n.y; ++j) std::fill_n(tile.out_row(j, k), n.x, T{});
    });
}

}  // namespace

Transition filter_separable() {
    return filtering_edge({
        .name = "filter.separable",
        .source = "[W93] EQ 6; Bebendorf 2000",
        .refused = not_separable,
        .operations =
            [](const PassAsk& ask) { return operations_of(ask, products_of(ask.of).value()); },
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::f64)
                    run_separable<double>(run);
                else
                    run_separable<float>(run);
            },
    });
}

}  // namespace edgewise
