#include "quartic.h"

#include <cmath>

namespace mp2p_icp_certify
{
namespace
{
enum
{
    W,
    X,
    Y,
    Z
};

struct Term
{
    Real coefficient;
    int first, second;
};

Polynomial quadratic(std::initializer_list<Term> terms)
{
    Polynomial p;
    for (const auto& t : terms)
    {
        Exponents e{};
        e[static_cast<size_t>(t.first)]++, e[static_cast<size_t>(t.second)]++;
        p[e] += t.coefficient;
    }
    return p;
}

using PolynomialMat3 = std::array<std::array<Polynomial, 3>, 3>;

/// R(q), for |q| = 1; |q|^2 R(q) otherwise.
PolynomialMat3 rotation_of_quaternion()
{
    const auto diagonal = [](Real x, Real y, Real z) {
        return quadratic({{1, W, W}, {x, X, X}, {y, Y, Y}, {z, Z, Z}});
    };
    const auto pair = [](int a, int b, Real sign, int c) { return quadratic({{2, a, b}, {2 * sign, W, c}}); };
    return {{{diagonal(1, -1, -1), pair(X, Y, -1, Z), pair(X, Z, 1, Y)},
             {pair(X, Y, 1, Z), diagonal(-1, 1, -1), pair(Y, Z, -1, X)},
             {pair(X, Z, -1, Y), pair(Y, Z, 1, X), diagonal(-1, -1, 1)}}};
}
}  // namespace

void add_product(Polynomial& sum, Real factor, const Polynomial& a, const Polynomial& b)
{
    for (const auto& [ea, ca] : a)
        for (const auto& [eb, cb] : b)
            sum[{ea[0] + eb[0], ea[1] + eb[1], ea[2] + eb[2], ea[3] + eb[3]}] += factor * ca * cb;
}

Polynomial cost_around(const CostForm& form, const Mat3& R0)
{
    const PolynomialMat3 Rq = rotation_of_quaternion();
    const Polynomial one = {{Exponents{}, 1}};
    std::array<Polynomial, 10> x;
    for (size_t col = 0; col < 3; col++)
        for (size_t row = 0; row < 3; row++)
            for (size_t k = 0; k < 3; k++)
                add_product(x[3 * col + row], R0(static_cast<int>(row), static_cast<int>(k)), one,
                            Rq[k][col]);
    x[9] = quadratic({{1, W, W}, {1, X, X}, {1, Y, Y}, {1, Z, Z}});  // 1, for unit q

    Polynomial f;
    for (size_t i = 0; i < 10; i++)
        for (size_t j = 0; j < 10; j++)
            add_product(f, form.of_rotation(static_cast<int>(i), static_cast<int>(j)), x[i], x[j]);
    return f;
}

Polynomial certificate_polynomial(const Mat9& G)
{
    const Real r = std::sqrt(Real(2));
    const std::array<Polynomial, 9> z = {
        quadratic({{r, W, X}}), quadratic({{r, W, Y}}), quadratic({{r, W, Z}}),
        quadratic({{1, X, X}}), quadratic({{1, Y, Y}}), quadratic({{1, Z, Z}}),
        quadratic({{r, X, Y}}), quadratic({{r, X, Z}}), quadratic({{r, Y, Z}})};
    Polynomial p;
    for (size_t i = 0; i < 9; i++)
        for (size_t j = 0; j < 9; j++)
            add_product(p, G(static_cast<int>(i), static_cast<int>(j)), z[i], z[j]);
    return p;
}

}  // namespace mp2p_icp_certify
