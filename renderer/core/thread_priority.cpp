// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/thread_priority.h"

#include <sys/resource.h>

namespace scolopax {

void lowerThreadPriority() {
#ifdef __linux__
  // Linux counts niceness by thread: 0 is the calling one.
  setpriority(PRIO_PROCESS, 0, 4);
#endif
}

}  // namespace scolopax
