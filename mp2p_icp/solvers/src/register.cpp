#include <mp2p_icp/Solver_Certified.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/Solver_OLAE.h>
#include <mrpt/core/initializer.h>

MRPT_INITIALIZER(register_mp2p_icp_solvers)
{
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Solver, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Solver_Certified, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Solver_Horn, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Solver_OLAE, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Solver_GaussNewton, mp2p_icp));
}
