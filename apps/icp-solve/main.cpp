#include <iostream>
#include <string>
#include <vector>

#include "icp_solve.h"

int main(int argc, char** argv)
{
    return mp2p_icp_apps::icp_solve({argv + 1, argv + argc}, std::cout, std::cerr);
}
