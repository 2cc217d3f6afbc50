# A room is one folder under mp2p_icp/, one CMake object library, one layer: its includes only point to
# the rooms it names in USES. Rooms are linked into the three exported libraries by mp2p_icp/CMakeLists.txt.

add_library(mp2p_icp_flags INTERFACE)
target_compile_options(mp2p_icp_flags INTERFACE
  -Wall -Wextra -Wconversion -Wshadow $<$<BOOL:${MP2PICP_WARNINGS_AS_ERRORS}>:-Werror>)
if(MP2PICP_SANITIZE)
  # Not alignment: MRPT's own headers break it (packed TMatchingPair, 16-byte members of its drawing classes).
  target_compile_options(mp2p_icp_flags INTERFACE
    -fsanitize=${MP2PICP_SANITIZE} -fno-sanitize=alignment -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(mp2p_icp_flags INTERFACE -fsanitize=${MP2PICP_SANITIZE})
endif()

# mp2p_icp_room(NAME [USES room...] [LINKS target...] [PRIVATE_LINKS target...])
function(mp2p_icp_room NAME)
  cmake_parse_arguments(ARG "" "" "USES;LINKS;PRIVATE_LINKS" ${ARGN})
  file(GLOB SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/*.cpp)
  set(ROOM mp2p_icp_room_${NAME})
  add_library(${ROOM} OBJECT ${SOURCES})
  set_target_properties(${ROOM} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${ROOM}
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${ROOM} PUBLIC ${ARG_LINKS} PRIVATE mp2p_icp_flags ${ARG_PRIVATE_LINKS})
  foreach(OTHER ${ARG_USES})
    target_link_libraries(${ROOM} PUBLIC mp2p_icp_room_${OTHER})  # its headers; the objects go into the libraries
  endforeach()
endfunction()

# mp2p_icp_library(NAME ROOMS room... [LINKS target...] [PRIVATE_LINKS target...]): one exported shared library.
function(mp2p_icp_library NAME)
  cmake_parse_arguments(ARG "" "" "ROOMS;LINKS;PRIVATE_LINKS" ${ARGN})
  set(OBJECTS "")
  foreach(ROOM ${ARG_ROOMS})
    list(APPEND OBJECTS $<TARGET_OBJECTS:mp2p_icp_room_${ROOM}>)
  endforeach()
  add_library(${NAME} SHARED ${OBJECTS})
  add_library(mp2p_icp::${NAME} ALIAS ${NAME})
  set_target_properties(${NAME} PROPERTIES VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  foreach(ROOM ${ARG_ROOMS})
    target_include_directories(${NAME} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/${ROOM}/include>)
    install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/${ROOM}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  endforeach()
  target_include_directories(${NAME} PUBLIC $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(${NAME} PUBLIC cxx_std_17)
  target_link_libraries(${NAME} PUBLIC ${ARG_LINKS} PRIVATE $<BUILD_INTERFACE:mp2p_icp_flags> ${ARG_PRIVATE_LINKS})
endfunction()
