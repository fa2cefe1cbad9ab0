#include "charts/courses.hpp"

#include <algorithm>

#include "charts/families.hpp"

namespace edgewise::charts {
namespace {

bool is_worth_it(const Course& course, const Table& table) {
    std::size_t fronts = 0;
    for (const std::size_t i : course.points) {
        if (table.points[i].chosen) return true;
        fronts += table.points[i].front;
    }
    return 2 * fronts >= course.points.size();
}

}  // namespace

std::vector<Course> courses_of(const Table& table) {
    std::vector<Course> courses;
    for (std::size_t i = 0; i < table.points.size(); ++i) {
        const Point& point = table.points[i];
        if (!point.measured.seconds || !point.at) continue;
        auto course = std::find_if(courses.begin(), courses.end(),
                                   [&](const Course& other) { return other.path == point.path; });
        if (course == courses.end())
            course = courses.insert(courses.end(), {point.path, point.family, {}});
        course->points.push_back(i);
    }
    for (Course& course : courses)
        std::stable_sort(course.points.begin(), course.points.end(),
                         [&](auto a, auto b) { return *table.points[a].at < *table.points[b].at; });
    const std::vector<std::string> families = families_of(table);
    const auto rank = [&](const Course& course) {
        const auto family = std::find(families.begin(), families.end(), course.family);
        return std::pair(!is_worth_it(course, table), family);
    };
    std::stable_sort(courses.begin(), courses.end(),
                     [&](const Course& a, const Course& b) { return rank(a) < rank(b); });
    for (std::size_t i = 0; i < courses.size() && is_worth_it(courses[i], table); ++i) {
        courses[i].number = i + 1;
        if (i > 0 && courses[i].family == courses[i - 1].family)
            courses[i].dash = courses[i - 1].dash + 1;
    }
    return courses;
}

}  // namespace edgewise::charts
