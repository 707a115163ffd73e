#include "lib/panorama/small_solver.hpp"

#include <Eigen/Cholesky>

namespace stx::panorama {

bool solveSymmetric(std::vector<double>& matrix, std::vector<double>& right) {
    const auto n = static_cast<Eigen::Index>(right.size());
    Eigen::Map<Eigen::MatrixXd> m(matrix.data(), n, n);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(m);
    if (factors.info() != Eigen::Success) return false;
    factors.solveInPlace(Eigen::Map<Eigen::VectorXd>(right.data(), n));
    return true;
}

}  // namespace stx::panorama
