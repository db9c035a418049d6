// SPDX-License-Identifier: Apache-2.0
#include "server/commands/data_options.h"

#include <utility>

namespace scolopax {
namespace {

/// `name` must have passed the check.
io::FourthAxis fourthAxisOf(const std::string& name) {
  if (name == "time") return io::FourthAxis::time;
  if (name == "member") return io::FourthAxis::member;
  return name == "channel" ? io::FourthAxis::channel : io::FourthAxis::automatic;
}

}  // namespace

void addDataOptions(CLI::App& command, DataOptions& options, const std::function<void(CLI::Option&)>& added) {
  CLI::Option* const all[] = {
      command
          .add_option(
              "--fourth-axis", options.fourthAxis,
              "What a fourth axis of NIfTI and NRRD files is; auto: as the header says, otherwise "
              "channels if it has a length of 3, and times if not. channel also makes numbered files "
              "channels, which are times otherwise. member: times are members of an ensemble, of which "
              "there is also a data set with mean, variance, minimum and maximum")
          ->check(CLI::IsMember({"auto", "time", "channel", "member"}))
          ->capture_default_str(),
      command
          .add_option("--allow-host", options.allowedHosts,
                      "Server from which PATHs that are URLs may be read: HOST for the usual ports, or "
                      "HOST:PORT; may be repeated")
          ->type_name("HOST")
          ->allow_extra_args(false)};
  if (!added) return;
  for (CLI::Option* option : all) added(*option);
}

io::OpenOptions openOptionsOf(const DataOptions& options, io::Warn warn) {
  return {.fourthAxis = fourthAxisOf(options.fourthAxis),
          .warn = std::move(warn),
          .allowedHosts = options.allowedHosts};
}

}  // namespace scolopax
