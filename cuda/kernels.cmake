# SPDX-License-Identifier: Apache-2.0
# The files that compile the kernels, generated from the list of integrators: two each, because the kernels of plain
# scenes (kernel::kPlainDevice) are compiled without what only other scenes need.
# NAME|header under renderer/kernel|type under scolopax::kernel
set(SCOLOPAX_INTEGRATORS
  "superposed|trackers/one_process.h|Analog<kernel::Superposed>"
  "cumulative|trackers/one_process.h|Analog<kernel::Cumulative>"
  "sync_dda|trackers/process_per_channel.h|Analog<kernel::SyncDda>"
  "n_dda|trackers/process_per_channel.h|Analog<kernel::NDda>"
  "raymarch|raymarch.h|RayMarch<kernel::EqualSteps>"
  "raymarch_voxels|raymarch.h|RayMarch<kernel::VoxelCells>")
set(folder ${CMAKE_BINARY_DIR}/cuda/kernels)
set(SCOLOPAX_PLAIN_KERNELS)
set(SCOLOPAX_ALL_KERNELS ${CMAKE_CURRENT_LIST_DIR}/rebuild_totals.cu)
foreach(entry ${SCOLOPAX_INTEGRATORS})
  string(REPLACE "|" ";" entry "${entry}")
  list(GET entry 0 name)
  list(GET entry 1 header)
  list(GET entry 2 type)
  set(code "#include \"cuda/pixel_kernels.h\"\n#include \"renderer/kernel/analog.h\"\n#include \"renderer/kernel/${header}\"\n\n")
  set(instance "template scolopax::cuda::LaunchFunction scolopax::cuda::launchOf<scolopax::kernel::${type}, scolopax::kernel")
  string(REPLACE "<kernel::" "<scolopax::kernel::" instance "${instance}")
  file(CONFIGURE OUTPUT ${folder}/plain_${name}.cu @ONLY
    CONTENT "#define SCOLOPAX_PLAIN_SCENES\n${code}${instance}::PlainSceneView>(const scolopax::Instance&);\n")
  file(CONFIGURE OUTPUT ${folder}/all_${name}.cu @ONLY CONTENT "${code}${instance}::SceneView>(const scolopax::Instance&);\n")
  list(APPEND SCOLOPAX_PLAIN_KERNELS ${folder}/plain_${name}.cu)
  list(APPEND SCOLOPAX_ALL_KERNELS ${folder}/all_${name}.cu)
endforeach()
