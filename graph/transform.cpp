#include "graph/transform.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

/// An exact map stays exact: an inverse would leave rounding where none belongs.
Mat4 inverse_of(const Mat4& matrix) {
    return matrix == Mat4::Identity() ? matrix : Mat4(matrix.inverse());
}

Mat4 product(const Mat4& after, const Mat4& first) {
    if (first == Mat4::Identity()) return after;
    return after == Mat4::Identity() ? first : Mat4(after * first);
}

}  // namespace

Transform::Transform(std::shared_ptr<const Deformation> deformation)
    : matrix_(Mat4::Identity()), parts_{{Mat4::Identity(), std::move(deformation), false}} {}

const Mat4& Transform::matrix() const {
    if (!is_matrix()) throw RequestError(fmt::format("the transform '{}' is no matrix", name()));
    return matrix_;
}

Vec3 Transform::apply(const Mat4& matrix, const Vec3& at) {
    const Eigen::Vector4d to = matrix * Eigen::Vector4d(at.x(), at.y(), at.z(), 1);
    if (to[3] == 1) return to.head<3>();
    if (!(to[3] > 0)) return Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    return to.head<3>() / to[3];
}

Vec3 Transform::apply(const Part& part, const Vec3& at) {
    if (!part.deformation) return apply(part.matrix, at);
    return part.back ? part.deformation->invert(at) : part.deformation->apply(at);
}

Vec3 Transform::apply(const Vec3& at) const {
    if (is_matrix()) return apply(matrix_, at);
    Vec3 place = at;
    for (const Part& part : parts_) place = apply(part, place);
    return place;
}

Mat3 Transform::jacobian(const Vec3& at) const {
    const auto of_matrix = [](const Mat4& matrix, const Vec3& from) -> Mat3 {
        const Eigen::Vector4d to = matrix * Eigen::Vector4d(from.x(), from.y(), from.z(), 1);
        const Mat3 linear = matrix.topLeftCorner<3, 3>();
        const Eigen::RowVector3d last = matrix.block<1, 3>(3, 0);
        return (linear - to.head<3>() / to[3] * last) / to[3];
    };
    if (is_matrix()) return of_matrix(matrix_, at);
    Mat3 all = Mat3::Identity();
    Vec3 place = at;
    for (const Part& part : parts_) {
        const Vec3 next = apply(part, place);
        if (!part.deformation)
            all = of_matrix(part.matrix, place) * all;
        else if (part.back)
            all = part.deformation->jacobian(next).inverse() * all;
        else
            all = part.deformation->jacobian(place) * all;
        place = next;
    }
    return all;
}

void Transform::append(Part part) {
    if (!part.deformation && part.matrix == Mat4::Identity()) return;
    if (!part.deformation && !parts_.empty() && !parts_.back().deformation) {
        parts_.back().matrix = product(part.matrix, parts_.back().matrix);
        if (parts_.back().matrix == Mat4::Identity()) parts_.pop_back();
        return;
    }
    if (part.deformation && !parts_.empty() && parts_.back().deformation == part.deformation &&
        parts_.back().back != part.back) {
        parts_.pop_back();
        return;
    }
    parts_.push_back(std::move(part));
}

Transform Transform::inverse() const {
    if (is_matrix()) return inverse_of(matrix_);
    Transform inverse;
    for (auto part = parts_.rbegin(); part != parts_.rend(); ++part)
        inverse.parts_.push_back(part->deformation
                                     ? Part{Mat4::Identity(), part->deformation, !part->back}
                                     : Part{inverse_of(part->matrix)});
    return inverse;
}

Transform operator*(const Transform& after, const Transform& first) {
    if (after.is_matrix() && first.is_matrix()) return product(after.matrix_, first.matrix_);
    Transform both;
    for (const Transform* one : {&first, &after}) {
        if (one->is_matrix()) both.append({one->matrix_});
        for (const Transform::Part& part : one->parts_) both.append(part);
    }
    // What is left where deformations cancelled is a matrix again.
    if (both.parts_.size() == 1 && !both.parts_[0].deformation) return both.parts_[0].matrix;
    return both;
}

std::vector<std::int64_t> Transform::key(double to) const {
    std::vector<std::int64_t> key;
    const auto add = [&](const Mat4& matrix) {
        for (int i = 0; i < 16; ++i) key.push_back(std::llround(matrix.data()[i] / to));
    };
    if (is_matrix()) add(matrix_);
    for (const Part& part : parts_) {
        if (part.deformation) {
            key.push_back(part.back ? -1 : 1);
            key.push_back(reinterpret_cast<std::intptr_t>(part.deformation.get()));
        } else {
            add(part.matrix);
        }
    }
    return key;
}

std::string Transform::name() const {
    std::string all;
    for (const Part& part : parts_)
        if (part.deformation) all += (all.empty() ? "" : ", ") + part.deformation->name();
    return all;
}

}  // namespace edgewise
