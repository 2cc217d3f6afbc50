#include <iostream>
#include <string>
#include <vector>

#include "icp_certify.h"

int main(int argc, char** argv)
{
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    return mp2p_icp_certify::icp_certify(arguments, std::cout, std::cerr);
}
