# What a build of mp2p_icp, and a project that uses an installed one, must find.
# Included by the top CMakeLists.txt and by the installed *-config.cmake files.
find_package(MRPT 2.5.8 REQUIRED COMPONENTS
  core containers rtti serialization math poses random expr obs maps opengl tfest img io system)
find_package(Eigen3 3.4 REQUIRED)
