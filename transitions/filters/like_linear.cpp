#include "transitions/filters/like_linear.hpp"

#include "transitions/filters/field_filter.hpp"

namespace edgewise {

Like like_linear(Field field) {
    const bool labels = field == Field::nearest;
    Like like;
    like.filter = field_filter(labels ? Field::nearest : Field::linear).name;
    if (labels) return like;
    for (const Filter& filter : filters())
        if (filter.taps == 1) like.barred.insert(filter.name);
    like.barred.insert("me");  // no filter: warp.permutation sends samples on as they are
    return like;
}

}  // namespace edgewise
