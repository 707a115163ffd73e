#pragma once

#include <vector>

namespace stx::panorama {

/// Solves matrix * x = right for a symmetric, positive definite matrix of n x n numbers, row by row
/// (Cholesky). `right` becomes x; the matrix is used up. False, and nothing of use in `right`, when
/// it is not positive definite.
[[nodiscard]] bool solveSymmetric(std::vector<double>& matrix, std::vector<double>& right);

}  // namespace stx::panorama
