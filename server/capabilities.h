// SPDX-License-Identifier: Apache-2.0
// The answer to GET /capabilities, which is also part of each stream's hello.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "server/config.h"

namespace scolopax::server {

nlohmann::json capabilitiesJson(const Config& config);

}  // namespace scolopax::server
