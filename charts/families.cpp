#include "charts/families.hpp"

#include <algorithm>

namespace edgewise::charts {

std::vector<std::string> families_of(const Table& table) {
    std::vector<std::string> families;
    for (const Point& point : table.points)
        if (std::find(families.begin(), families.end(), point.family) == families.end())
            families.push_back(point.family);
    return families;
}

Style style_of(std::size_t place) noexcept {
    // Neighbours of the list differ in lightness, for prints in grey. Okabe and Ito's yellow is
    // left out: on white it is not seen.
    static constexpr const char* kColours[] = {"#0072b2", "#e69f00", "#009e73", "#cc79a7",
                                               "#d55e00", "#56b4e9", "#7f7f7f"};
    struct Shape {
        const char* name;
        int gnuplot;
    };
    static constexpr Shape kShapes[] = {{"circle", 6}, {"square", 4},   {"up", 8},
                                        {"down", 10},  {"diamond", 12}, {"pentagon", 14}};
    const Shape& shape = kShapes[place % std::size(kShapes)];
    return {kColours[place % std::size(kColours)], shape.name, shape.gnuplot};
}

}  // namespace edgewise::charts
