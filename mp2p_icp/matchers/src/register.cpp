#include <mp2p_icp/Matcher_Adaptive.h>
#include <mp2p_icp/Matcher_Cov2Cov.h>
#include <mp2p_icp/Matcher_Lines.h>
#include <mp2p_icp/Matcher_Planes.h>
#include <mp2p_icp/Matcher_Point2Line.h>
#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/Matcher_Points_InlierRatio.h>
#include <mrpt/core/initializer.h>

MRPT_INITIALIZER(register_mp2p_icp_matchers)
{
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Cov2Cov, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Lines, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Planes, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Points_Base, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Points_DistanceThreshold, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Points_InlierRatio, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Point2Plane, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Point2Line, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(Matcher_Adaptive, mp2p_icp));
}
