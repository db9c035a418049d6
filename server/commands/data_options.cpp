// SPDX-License-Identifier: Apache-2.0
#include "server/commands/data_options.h"

namespace scolopax {

CLI::Option* checkFourthAxis(CLI::Option* option) {
  return option->check(CLI::IsMember({"auto", "time", "channel"}));
}

io::FourthAxis fourthAxisOf(const std::string& name) {
  if (name == "time") return io::FourthAxis::time;
  return name == "channel" ? io::FourthAxis::channel : io::FourthAxis::automatic;
}

}  // namespace scolopax
