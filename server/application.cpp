// SPDX-License-Identifier: Apache-2.0
#include "server/application.h"

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include "protocol/problem.h"
#include "server/api.h"
#include "server/auth.h"
#include "server/background.h"
#include "server/capabilities.h"
#include "server/loop_thread.h"
#include "server/net/server.h"
#include "server/render_loop.h"

namespace scolopax::server {
namespace {

constexpr std::string_view kNoPage =
    "Scolopax is running, but its page is not built.\n\n"
    "Build it with:  cd client_web && npm ci && npm run build\n"
    "and reload this address, or use the HTTP interface under api/v1/ (see api/v1/openapi.json).\n";

}  // namespace

// Members are constructed in this order, each after the ones that it uses.
struct Application::Impl {
  Config config;
  Log log;
  MakeRenderer makeRenderer;
  std::shared_ptr<MemoryBudget> memory;
  std::atomic<bool> stopping{false};
  std::stop_source abortRequests;
  const Now now = [] { return std::chrono::steady_clock::now(); };
  LoopThread renderThread, watchThread, encodeThread;
  // Separate, so that short jobs do not wait for long ones: a part of a pass or a pick is short, measuring an
  // error takes many times longer.
  BackgroundThreads pictures, passes{std::max<std::size_t>(1, processors() / 2)}, errors, builds;
  // Few threads, so that encoding for one client does not delay the frames of others.
  BackgroundThreads encoders{std::min<std::size_t>(2, processors())};
  Metrics metrics;
  std::shared_ptr<const DatasetStore> datasets;
  std::shared_ptr<const SceneResolver> resolver;
  SessionStore sessions;
  RenderLoop renderLoop;
  EncodeLoop encodeLoop;
  nlohmann::json capabilities;
  StreamHub streams;
  UnsentAnswers answers;
  ApiContext context;
  Authorizer authorizer;
  std::optional<net::Server> server;

  Impl(Config given, std::shared_ptr<const DatasetStore> store, MakeRenderer make,
       std::shared_ptr<MemoryBudget> budget, Log logLine)
      : config(std::move(given)),
        log(std::move(logLine)),
        makeRenderer(std::move(make)),
        memory(std::move(budget)),
        datasets(std::move(store)),
        resolver(std::make_shared<const SceneResolver>(
            datasets, SceneResolver::Options{.maxPixels = config.maxPixels, .memory = memory})),
        sessions(resolver, {.maxSessions = config.maxSessions, .keep = config.keepSession},
                 {.now = now,
                  .wakeRender = [this] { renderThread.wake(); },
                  .wakeEncoder = [this] { encodeThread.wake(); },
                  .interruptRender = [this] { renderLoop.interrupt(); }}),
        renderLoop(sessions,
                   {.makeRenderer = makeRenderer,
                    .policy = {},
                    .now = now,
                    .log = log,
                    .pictures = pictures,
                    .passes = passes,
                    .errors = errors,
                    .builds = builds,
                    .wake = [this] { renderThread.wake(); },
                    .memory = memory,
                    .wakeWatch = [this] { watchThread.wake(); },
                    .maxPickSeconds = config.maxRenderSeconds,
                    .volumes = datasets->cache(),
                    .prefetch = datasets->cache() ? std::make_shared<Prefetch>(memory) : nullptr},
                   [this](const PassResult& pass) { metrics.passEnded(pass); }),
        encodeLoop(
            sessions, now, log, pictures, [this] { encodeThread.wake(); }, memory),
        capabilities(capabilitiesJson(config)),
        streams(sessions, builds, metrics,
                {.maxClients = config.maxClients,
                 .limits = {.bytes = config.maxMessageBytes, .depth = config.maxJsonDepth},
                 .capabilities = capabilities,
                 .log = log,
                 .now = now}),
        answers(memory),
        context{.config = config,
                .datasets = *datasets,
                .renderResolver = *resolver,
                .sessions = sessions,
                .streams = streams,
                .metrics = metrics,
                .encoders = encoders,
                .makeRenderer = makeRenderer,
                .memory = memory,
                .answers = answers,
                .log = log,
                .stopping = stopping,
                .abortRequests = abortRequests.get_token(),
                .now = now,
                .capabilities = [this] { return capabilities; },
                .unreadTextBytes = [this] { return server->unreadTextBytes(); },
                .requestBodyBytes = [this] { return server->requestBodyBytes(); }},
        authorizer(config.token, isLoopback(config.host), config.allowedOrigins,
                   !config.certificateFile.empty()) {
    net::Options options = networkOptions();
    const bool hasPage = !options.staticRoot.empty();
    server.emplace(std::move(options));
    if (!hasPage)
      server->route("GET", "/", [](const net::Request&) {
        return net::Response{200, "text/plain; charset=utf-8", std::string(kNoPage), {}};
      });
    addApi(*server, context);
  }

  net::Options networkOptions() {
    net::Options options;
    options.host = config.host;
    options.port = config.port;
    options.bodyLimit = config.maxBodyBytes;
    options.messageLimit = config.maxMessageBytes;
    options.allowedOrigins = config.allowedOrigins;
    options.trustedProxies = config.trustedProxies;
    options.certificateFile = config.certificateFile;
    options.keyFile = config.keyFile;
    if (std::filesystem::is_directory(config.webRoot)) options.staticRoot = config.webRoot;
    options.authorize = [this](const net::Request& request) { return authorizer(request); };
    options.knows = [this](const net::Request& request) { return authorizer.knows(request); };
    options.flowOf = [this](const net::Request& request) { return flowOf(sessions, request); };
    options.problem = [](int status, const std::string& detail) {
      return errorResponse(protocol::ProtocolError(status, "", detail));
    };
    options.decorate = [this](net::Response& response) {
      metrics.requestAnswered(response.status);
      response.headers.emplace_back("X-Content-Type-Options", "nosniff");
      response.headers.emplace_back("Referrer-Policy", "no-referrer");
    };
    options.log = log;
    return options;
  }
};

Application::Application(Config config, std::shared_ptr<const DatasetStore> datasets,
                         MakeRenderer makeRenderer, std::shared_ptr<MemoryBudget> memory, Log log) {
  if (config.token.empty()) config.token = createToken();
  impl_ = std::make_unique<Impl>(std::move(config), std::move(datasets), std::move(makeRenderer),
                                 std::move(memory), std::move(log));
}

Application::~Application() { stop(); }

void Application::start() {
  impl_->renderThread.start([this] { return impl_->renderLoop.step(); });
  impl_->watchThread.start([this] { return impl_->renderLoop.watch(); });
  impl_->encodeThread.start([this] { return impl_->encodeLoop.step(); });
  impl_->server->start();
}

std::uint16_t Application::port() const { return impl_->server->port(); }

std::string Application::url() const {
  const Config& config = impl_->config;
  return tokenUrl(config.host, port(), config.token, !config.certificateFile.empty());
}

void Application::stop() {
  impl_->stopping = true;
  // Requests that wait are ended at once. Those that render get part of the grace period to finish, because
  // the network waits for its last handler.
  std::jthread cut([this](const std::stop_token& stopped) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_for(lock, stopped, impl_->config.stopGrace * 2 / 3,
                                           [] { return false; });
    impl_->abortRequests.request_stop();
  });
  impl_->sessions.closeAll(net::kStopping);
  impl_->server->stop(impl_->config.stopGrace);
  impl_->renderLoop.stop();
  impl_->renderThread.stop();
  impl_->watchThread.stop();
  impl_->encodeThread.stop();
}

}  // namespace scolopax::server
