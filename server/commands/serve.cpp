// SPDX-License-Identifier: Apache-2.0
#include "server/commands/serve.h"

#include <fcntl.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "renderer/core/error.h"
#include "renderer/renderer.h"
#include "server/application.h"
#include "server/auth.h"
#include "server/command_config.h"
#include "server/commands/data_options.h"
#include "server/commands/render_device.h"
#include "server/commands/validators.h"
#include "server/limits.h"
#include "server/net/client_address.h"
#include "server/net/server.h"
#include "server/scene_resolver.h"

namespace scolopax {
namespace {

struct ServeOptions {
  server::Config config;
  std::vector<std::filesystem::path> paths;
  std::filesystem::path dataRoot;
  DataOptions data;
  std::string tokenFile;
  std::string configFile;
  std::string device = "auto", whenDeviceFails = "cpu";
  std::string logLevel = "info";
  double keepSeconds = 300;
  std::uint64_t memoryMebibytes = io::defaultMemoryLimitBytes() >> 20;
  std::uint64_t maxMemoryMebibytes = io::defaultMemoryLimitBytes() / 2 >> 20;
};

/// The option that sets Config::maxMemoryBytes, in MiB.
constexpr std::string_view kMaxMemory = "max-memory";

/// The folder of the built page: where the build put it, or relative to the program; empty if there is none.
std::string findWebRoot() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  for (const std::filesystem::path& folder :
       {std::filesystem::path(SCOLOPAX_WEB_ROOT), program.parent_path() / "../../client_web/dist"})
    if (std::filesystem::is_directory(folder, error)) return std::filesystem::canonical(folder);
  return "";
}

// A signal may be delivered to any thread, so its handler only writes to a pipe, which the main thread reads.
int signalPipe[2] = {-1, -1};

extern "C" void onSignal(int) {
  const int before = errno;
  const char byte = 0;
  [[maybe_unused]] const auto written = write(signalPipe[1], &byte, 1);
  errno = before;
}

void catchSignals() {
  if (pipe2(signalPipe, O_CLOEXEC) != 0) throw Error(ErrorCode::io, "cannot make a pipe for signals");
  struct sigaction action = {};
  action.sa_handler = onSignal;
  action.sa_flags = int(SA_RESETHAND | SA_RESTART);  // a second signal of the same kind ends the program
  for (const int signal : {SIGTERM, SIGINT}) sigaction(signal, &action, nullptr);
}

void waitForSignal() {
  char byte;
  while (read(signalPipe[0], &byte, 1) < 0 && errno == EINTR) {
  }
}

/// Logs what is served, and what of it does not fit into the memory.
void describe(const server::DatasetStore& datasets, spdlog::logger& log) {
  for (const auto& dataset : datasets.all()) {
    const auto& dims = dataset->grid().dims;
    log.info("data set {}: {} x {} x {}, {} channels, {} times", dataset->id(), dims.x, dims.y, dims.z,
             dataset->headers().channels.size(), dataset->times());
    const std::uint64_t limit = datasets.cache()->limitBytes();
    if (dataset->memoryBytes() > limit)
      log.warn("data set {} needs {} MiB of memory and cannot be shown: --memory is {}", dataset->id(),
               dataset->memoryBytes() >> 20, limit >> 20);
    else if (dataset->level() > 0)
      log.warn(
          "data set {} is shown at level {}, because its finest level needs {} MiB of memory: --memory is {}",
          dataset->id(), dataset->level(), io::memoryBytes(dataset->headers()) >> 20, limit >> 20);
  }
}

void serve(ServeOptions options) {
  if (options.paths.empty())
    throw CLI::ValidationError(
        "serve",
        "expected at least one volume file. For a first picture: scolopax generate orbitals orbitals.nrrd, "
        "then scolopax serve orbitals.nrrd");
  const auto log =
      std::make_shared<spdlog::logger>("scolopax", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log->set_level(spdlog::level::from_str(options.logLevel));
  log->flush_on(spdlog::level::info);
  const auto warn = [log](const std::string& line) { log->warn(line); };

  if (!options.tokenFile.empty()) options.config.token = readTokenFile(options.tokenFile);
  options.config.keepSession = std::chrono::milliseconds((long long)(options.keepSeconds * 1000));
  options.config.maxMemoryBytes = options.maxMemoryMebibytes << 20;
  options.config.webRoot = findWebRoot();
  const server::Config& config = options.config;
  if (config.certificateFile.empty() != config.keyFile.empty())
    throw CLI::ValidationError("serve", "expected --tls-cert and --tls-key together, found only --tls-" +
                                            std::string(config.keyFile.empty() ? "cert" : "key"));
  net::checkTlsFiles(config.certificateFile, config.keyFile);
  if (!isLoopback(config.host) && config.certificateFile.empty())
    log->warn("{} can be reached from other machines, and the traffic is not encrypted", config.host);

  const auto opened = io::openDatasets(server::pathsBelowRoot(options.paths, options.dataRoot),
                                       openOptionsOf(options.data, warn));
  const auto memory = std::make_shared<MemoryBudget>(options.config.maxMemoryBytes);
  const auto datasets = std::make_shared<const server::DatasetStore>(
      opened, std::make_shared<server::VolumeCache>(options.memoryMebibytes << 20, warn), memory);
  describe(*datasets, *log);
  const RendererFactory factory =
      rendererFactory(options.device, config.threads, memory, options.whenDeviceFails == "cpu", warn);
  options.config.backend = factory.backend;
  log->info("rendering on {}", factory.backend);
  server::Application application(options.config, datasets, factory.make, memory, warn);
  catchSignals();
  application.start();
  std::printf("Scolopax is ready: %s\n", application.url().c_str());
  std::fflush(stdout);
  waitForSignal();
  log->info("stopping");
  application.stop();
}

/// The environment variable that sets the option: SCOLOPAX_MAX_BODY for --max-body.
std::string variableOf(const std::string& option) {
  std::string variable = "SCOLOPAX_";
  for (const char c : option.substr(2))
    variable += c == '-' ? '_' : char(std::toupper(static_cast<unsigned char>(c)));
  return variable;
}

template <class Value>
CLI::Option* addOption(CLI::App& command, const std::string& name, Value& value, const std::string& doc) {
  return command.add_option("--" + name, value, doc)->envname(variableOf("--" + name))->capture_default_str();
}

/// Accepts an IP address, in its usual form.
CLI::Validator asAddress() {
  return {[](std::string& text) {
            const auto usual = net::usualAddress(text);
            if (!usual) return "expected an IP address, found " + text;
            text = *usual;
            return std::string();
          },
          ""};
}

void addServerOptions(CLI::App& command, ServeOptions& options) {
  server::Config& config = options.config;
  const auto add = [&command](const std::string& name, auto& value, const std::string& doc) {
    return addOption(command, name, value, doc);
  };
  command.add_option("PATH", options.paths, kDataDoc);
  addDataOptions(command, options.data,
                 [](CLI::Option& option) { option.envname(variableOf(option.get_name())); });
  add("host", config.host, "Address to listen on; 0.0.0.0: all addresses of this machine")
      ->type_name("ADDRESS");
  add("port", config.port, "Port to listen on; 0: any free one")->type_name("PORT");
  add("token-file", options.tokenFile,
      "File with the token that opens the server, one line of 16 to 512 letters, digits and -._~+/=; by "
      "default, a new random token at each start")
      ->type_name("FILE");
  add("tls-cert", config.certificateFile, "Certificate (PEM, with its chain): https instead of http")
      ->type_name("FILE");
  add("tls-key", config.keyFile, "Private key of that certificate (PEM, without a password)")
      ->type_name("FILE");
  add("data-root", options.dataRoot, "Folder that contains every PATH; the PATHs are relative to it")
      ->type_name("FOLDER");
  checkDevice(add("device", options.device, kDeviceDoc));
  add("when-device-fails", options.whenDeviceFails,
      "What sessions do after a CUDA device has failed: continue on the CPU, or end with the error")
      ->check(CLI::IsMember({"cpu", "end"}));
  add("threads", config.threads, "Threads for rendering; 0: all")->check(CLI::Range(0, 1024))->type_name("N");
  add("memory", options.memoryMebibytes,
      "MiB of memory for the voxels of data sets, which are loaded when they are first shown; those least "
      "recently used give way. Half of the machine's by default")
      ->check(CLI::Range(std::uint64_t(1), std::uint64_t(1) << 32))
      ->type_name("N");
  add("log-level", options.logLevel, "Lowest level of the messages that are logged on standard error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "critical", "off"}));
  add("allow-origin", config.allowedOrigins, "Another site whose pages may use this server; can be repeated")
      ->allow_extra_args(false)
      ->type_name("https://HOST");
  add("trusted-proxy", config.trustedProxies,
      "Proxy in front of this server, whose X-Forwarded-For names the client; can be repeated")
      ->allow_extra_args(false)
      ->transform(asAddress())
      ->type_name("ADDRESS");
}

void addLimits(CLI::App& command, ServeOptions& options) {
  const auto add = [&command](const std::string& name, auto& value, std::string doc) {
    doc[0] = char(std::toupper(static_cast<unsigned char>(doc[0])));
    return addOption(command, name, value, doc)->group("Limits")->type_name("N");
  };
  for (const server::Limit& limit : server::limits()) {
    const std::string name(limit.option);
    if (name == kMaxMemory)
      add(name, options.maxMemoryMebibytes,
          "MiB of memory for films, pictures, encodings, macrocells, gradient histograms, scenes with long "
          "curves and long answers, without the volumes; a quarter of the machine's by default")
          ->check(CLI::Range(std::uint64_t(64), std::uint64_t(1) << 32));
    else if (!name.empty())
      std::visit(
          [&](auto setting) {
            if constexpr (std::is_member_pointer_v<decltype(setting)>)
              add(name, options.config.*setting, std::string(limit.of))->check(CLI::PositiveNumber);
          },
          limit.value);
  }
  add("keep-session", options.keepSeconds, "Seconds until a session without clients ends")
      ->check(numberUpTo(1e9, true));
}

}  // namespace

CLI::App* addServeCommand(CLI::App& root) {
  auto options = std::make_shared<ServeOptions>();
  CLI::App* command = root.add_subcommand("serve", "Serve volumes to browsers and scripts until stopped");
  addServerOptions(*command, *options);
  addLimits(*command, *options);
  command->add_option("--config", options->configFile, "File with lines such as: port = 8081")
      ->envname("SCOLOPAX_CONFIG")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  command->footer(
      "Macrocells smaller than 4 voxels are refused if a data set would have more than " +
      std::to_string(server::SceneResolver::kMaxIntervals) +
      " of them, counted once\nfor each channel.\n"
      "Each option can also be set in the environment (--max-body as SCOLOPAX_MAX_BODY) or in the file of\n"
      "--config; the command line takes precedence over the environment, the environment over the file.\n"
      "The ready line on standard output contains the address of the page, with its token.\n"
      "SIGTERM and Ctrl-C shut the server down in order.");
  // With this callback, CLI11 reads the environment only when this command is parsed, and not for every
  // command.
  command->parse_complete_callback([] {});
  command->callback([options, command] {
    if (!options->configFile.empty()) applyConfigFile(*command, options->configFile);
    serve(*options);
  });
  return command;
}

}  // namespace scolopax
