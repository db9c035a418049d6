// SPDX-License-Identifier: Apache-2.0
// Routes that describe the data sets.
#include <nlohmann/json.hpp>

#include "protocol/problem.h"
#include "server/api.h"

namespace scolopax::server {
namespace {

std::shared_ptr<const Dataset> datasetAt(const ApiContext& context, const net::Request& request) {
  auto found = context.datasets.find(request.matches.at(1));
  if (!found)
    throw protocol::ProtocolError(404, "",
                                  "there is no data set " + protocol::shortened(request.matches.at(1)));
  return found;
}

net::Response listDatasets(const ApiContext& context) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& one : context.datasets.all()) list.push_back(describeJson(*one));
  return jsonResponse(200, {{"datasets", std::move(list)}});
}

/// What was measured of the data set, which is loaded first if necessary.
std::shared_ptr<const DatasetFacts> factsIn(const ApiContext& context, const net::Request& request,
                                            const Dataset& dataset) {
  if (auto facts = dataset.facts()) return facts;
  return inLongRequest(context, request,
                       [&](const std::stop_token& stop) { return dataset.factsOrLoad(stop); });
}

net::Response histogramAnswer(const ApiContext& context, const net::Request& request) {
  const auto dataset = datasetAt(context, request);
  const int channel = int(queryUnsigned(request, "channel", 0));
  return jsonResponse(200, histogramJson(factsIn(context, request, *dataset)->volume, channel));
}

net::Response gradientHistogramAnswer(const ApiContext& context, const net::Request& request) {
  const auto dataset = datasetAt(context, request);
  const int channel = int(queryUnsigned(request, "channel", 0));
  const bool joint = queryFlag(request, "joint");
  auto gradients = context.datasets.gradients(*dataset, channel);
  if (!gradients)
    gradients = inLongRequest(context, request, [&](const std::stop_token& stop) {
      return context.datasets.measuredGradients(*dataset, channel, stop);
    });
  return jsonResponse(200, gradientHistogramJson(dataset->facts()->volume, channel, *gradients, joint));
}

net::Response probeAnswer(const ApiContext& context, const net::Request& request) {
  const auto dataset = datasetAt(context, request);
  const double x = queryNumber(request, "x"), y = queryNumber(request, "y"), z = queryNumber(request, "z");
  const std::size_t time = dataset->stepAt(queryUnsigned(request, "time", 0));
  auto volume = dataset->loaded(time);
  if (!volume)
    volume = inLongRequest(context, request,
                           [&](const std::stop_token& stop) { return dataset->load(time, stop); });
  return jsonResponse(200, probeJson(*volume, x, y, z));
}

}  // namespace

std::vector<Route> datasetRoutes(ApiContext& context) {
  const Parameter id{"id", "path", "string", "Id of the data set"};
  const Parameter channel{"channel", "query", "integer", "Index of the channel, from 0 (default)"};
  const std::vector<std::string> kJson{"application/json"};
  return {
      {"GET",
       "/api/v1/datasets",
       "All data sets: dimensions, spacing, channels",
       {},
       "",
       kJson,
       {},
       [&context](const net::Request&) { return listDatasets(context); }},
      {"GET",
       "/api/v1/datasets/{id}",
       "One data set",
       {id},
       "",
       kJson,
       {},
       [&context](const net::Request& request) {
         return jsonResponse(200, describeJson(*datasetAt(context, request)));
       }},
      {"GET",
       "/api/v1/datasets/{id}/histogram",
       "Histogram of one channel's values",
       {id, channel},
       "",
       kJson,
       {},
       [&context](const net::Request& request) { return histogramAnswer(context, request); }},
      {"GET",
       "/api/v1/datasets/{id}/gradient-histogram",
       "Histogram of the magnitude of one channel's gradient",
       {id,
        channel,
        {"joint", "query", "boolean",
         "Whether to return it for every bin of values as well; false if absent"}},
       "",
       kJson,
       {},
       [&context](const net::Request& request) { return gradientHistogramAnswer(context, request); }},
      {"GET",
       "/api/v1/datasets/{id}/probe",
       "The channels' values at a point",
       {id,
        {"x", "query", "number", "World coordinate"},
        {"y", "query", "number", "World coordinate"},
        {"z", "query", "number", "World coordinate"},
        {"time", "query", "integer", "Step of a time series, from 0 (default)"}},
       "",
       kJson,
       {},
       [&context](const net::Request& request) { return probeAnswer(context, request); }},
  };
}

}  // namespace scolopax::server
