// SPDX-License-Identifier: Apache-2.0
// Picking with the kernels that render the picture: takes samples of single pixels, on the caller's thread.
#pragma once
#include <memory>

#include "renderer/data/pick.h"
#include "renderer/data/render_plan.h"
#include "renderer/launcher.h"

namespace scolopax {

/// `scene` is that of the plan, except that size, method, step and filter may differ.
std::unique_ptr<Picking> makePicking(std::shared_ptr<Launcher> launcher,
                                     std::shared_ptr<const RenderPlan> plan, const Scene& scene,
                                     const PixelArea& area);

}  // namespace scolopax
