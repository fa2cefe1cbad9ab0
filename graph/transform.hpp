#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace edgewise {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix4d;

/// A smooth map of space onto itself that no matrix is: a field of displacements, the distortion of
/// a lens. Never changed once it is made.
class Deformation {
 public:
    virtual ~Deformation() = default;
    /// What it is called in messages: "swirl".
    virtual std::string name() const = 0;
    virtual Vec3 apply(const Vec3& at) const = 0;
    /// The place that apply() brings here.
    virtual Vec3 invert(const Vec3& at) const = 0;
    /// Of apply(): column i is the derivative along axis i.
    virtual Mat3 jacobian(const Vec3& at) const = 0;
};

/// A map between index spaces: a matrix, or matrices and deformations one after another. A value:
/// copies share their deformations.
class Transform {
 public:
    /// 4x4, for columns; the last row differs from 0 0 0 1 only for homographies of images.
    Transform(const Mat4& matrix = Mat4::Identity())
        : matrix_(matrix) {}  // NOLINT: a matrix is one
    explicit Transform(std::shared_ptr<const Deformation> deformation);

    bool is_matrix() const noexcept { return parts_.empty(); }
    /// @throws RequestError where it is none; an edge that has not said that it takes any transform
    /// is not asked about such (Transition::any_transform)
    const Mat4& matrix() const;
    /// Null where it is none.
    const Mat4* as_matrix() const noexcept { return is_matrix() ? &matrix_ : nullptr; }

    /// Where a place comes to lie; not finite where a homography sends it nowhere.
    Vec3 apply(const Vec3& at) const;
    Mat3 jacobian(const Vec3& at) const;
    Transform inverse() const;
    /// First the right one, then the left one. Matrices beside one another are multiplied.
    friend Transform operator*(const Transform& after, const Transform& first);

    /// Equal where two transforms agree: entries of matrices to `to`, deformations as objects.
    std::vector<std::int64_t> key(double to) const;
    /// The deformations' names: "swirl, lens"; empty for a matrix.
    std::string name() const;

 private:
    /// A matrix, or a deformation there or back.
    struct Part {
        Mat4 matrix = Mat4::Identity();
        std::shared_ptr<const Deformation> deformation = {};
        bool back = false;
    };
    static Vec3 apply(const Mat4& matrix, const Vec3& at);
    static Vec3 apply(const Part& part, const Vec3& at);
    void append(Part part);

    Mat4 matrix_;
    std::vector<Part> parts_;  // from first to last; empty: it is the matrix
};

}  // namespace edgewise
