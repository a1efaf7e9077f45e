# For the CMakeLists.txt of each package: registers test/*.test with rostest, and test/test_*.py as one run of pytest.
function(robotont_add_tests)
  file(GLOB rostests CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test/*.test)
  if(rostests)
    find_package(rostest REQUIRED)
  endif()
  foreach(rostest ${rostests})
    add_rostest(${rostest})
  endforeach()
  file(GLOB unit_tests CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test/test_*.py)
  if(unit_tests)
    set(report ${CATKIN_TEST_RESULTS_DIR}/${PROJECT_NAME}/pytest.xml)
    catkin_run_tests_target("pytest" ${PROJECT_NAME} pytest.xml
      COMMAND "${PYTHON_EXECUTABLE} -m pytest --ignore-glob=*.test --junitxml=${report} ${CMAKE_CURRENT_SOURCE_DIR}/test"
      WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
  endif()
endfunction()
