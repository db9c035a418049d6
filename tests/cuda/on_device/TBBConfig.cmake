# SPDX-License-Identifier: Apache-2.0
# The library that on_device.sh has packed; its headers are among those of scolopax_flags.
if(NOT TARGET TBB::tbb)
  add_library(TBB::tbb SHARED IMPORTED)
  set_target_properties(TBB::tbb PROPERTIES IMPORTED_LOCATION ${SCOLOPAX_THIRD_PARTY}/lib/libtbb.so.12)
endif()
