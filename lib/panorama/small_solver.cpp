#include "lib/panorama/small_solver.hpp"

#include <cmath>
#include <cstddef>

namespace stx::panorama {

bool solveSymmetric(std::vector<double>& m, std::vector<double>& x) {
    const std::size_t n = x.size();
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = m[i * n + j];
            for (std::size_t k = 0; k < j; ++k) sum -= m[i * n + k] * m[j * n + k];
            if (i == j) {
                if (!(sum > 1e-300)) return false;
                m[i * n + i] = std::sqrt(sum);
            } else {
                m[i * n + j] = sum / m[j * n + j];
            }
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t k = 0; k < i; ++k) x[i] -= m[i * n + k] * x[k];
        x[i] /= m[i * n + i];
    }
    for (std::size_t i = n; i-- > 0;) {
        for (std::size_t k = i + 1; k < n; ++k) x[i] -= m[k * n + i] * x[k];
        x[i] /= m[i * n + i];
    }
    return true;
}

}  // namespace stx::panorama
