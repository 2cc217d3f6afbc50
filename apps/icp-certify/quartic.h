#pragma once

#include <array>
#include <map>

#include "cost_form.h"

namespace mp2p_icp_certify
{
/// Of a quaternion's w, x, y, z.
using Exponents = std::array<int, 4>;
/// Sum of coefficient * monomial.
using Polynomial = std::map<Exponents, Real>;

/// `sum += factor * a * b`
void add_product(Polynomial& sum, Real factor, const Polynomial& a, const Polynomial& b);

/// f(R0 R(q)), of degree 4, which for unit q is the least cost at that rotation.
Polynomial cost_around(const CostForm& form, const Mat3& R0);

/// z' G z with z = (r wx, r wy, r wz, xx, yy, zz, r xy, r xz, r yz), r = sqrt 2.
Polynomial certificate_polynomial(const Mat9& G);

}  // namespace mp2p_icp_certify
