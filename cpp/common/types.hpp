#pragma once
/// Eigen aliases shared by every room. Tables with one row per node, edge or stencil are row-major,
/// so that they map onto C-contiguous NumPy arrays.

#include <cstddef>

#include <Eigen/Core>

namespace withe {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixX2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
using MatrixX3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using MatrixX4 = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;
/// One row per stencil, each column together, so that packs load neighbours at once.
using Columns3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;
/// One row per edge: a 3 x 3 matrix with rows d1, d2, tangent, flattened row by row.
using MatrixX9 = Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor>;

/// An index as containers want it.
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// The component of the cross product that leaves the plane.
inline double cross(const Vector2& a, const Vector2& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace withe
