// SPDX-License-Identifier: Apache-2.0
#include "renderer/core/thread_priority.h"

#include <sys/resource.h>

namespace scolopax {

void lowerThreadPriority() {
#ifdef __linux__
  // On Linux niceness is per thread; 0 means the calling thread.
  setpriority(PRIO_PROCESS, 0, 4);
#endif
}

}  // namespace scolopax
