#include "solvers/minimum_degree.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace withe {

std::vector<int> minimum_degree_order(const SparsityPattern& pattern) {
  const std::vector<double> ones(pattern.row_indices.size(), 1.0);
  const Eigen::Map<const Eigen::SparseMatrix<double>> matrix(
      pattern.size, pattern.size, static_cast<Eigen::Index>(pattern.row_indices.size()), pattern.column_starts.data(),
      pattern.row_indices.data(), ones.data());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(Eigen::SparseMatrix<double>(matrix), order);
  return {order.indices().begin(), order.indices().end()};
}

}  // namespace withe
