// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "foxglove_schemas.hpp"

#include <initializer_list>
#include <utility>

#include <nlohmann/json.hpp>

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

Json typed(const char* type) { return {{"type", type}}; }

Json list_of(const Json& items) { return {{"type", "array"}, {"items", items}}; }

/// An object of which every property is required.
Json object(const char* title, std::initializer_list<std::pair<const char*, Json>> properties) {
  Json schema{{"title", title}, {"type", "object"}, {"properties", Json::object()}};
  schema["required"] = Json::array();
  for (const auto& [name, property] : properties) {
    schema["properties"][name] = property;
    schema["required"].push_back(name);
  }
  return schema;
}

Json numbers(const char* title, std::initializer_list<const char*> names) {
  Json schema = object(title, {});
  for (const char* name : names) {
    schema["properties"][name] = typed("number");
    schema["required"].push_back(name);
  }
  return schema;
}

/// "time" and "duration" are titles that the viewers look for.
Json time_of(const char* title) {
  Json seconds = typed("integer");
  Json rest{{"type", "integer"}, {"minimum", 0}, {"maximum", 999'999'999}};
  return object(title, {{"sec", seconds}, {"nsec", rest}});
}

}  // namespace

std::string scene_schema() {
  const Json time = time_of("time");
  const Json colour = numbers("foxglove.Color", {"r", "g", "b", "a"});
  const Json vector = numbers("foxglove.Vector3", {"x", "y", "z"});
  const Json pose = object("foxglove.Pose",
                           {{"position", vector},
                            {"orientation", numbers("foxglove.Quaternion", {"x", "y", "z", "w"})}});
  const Json line = object("foxglove.LinePrimitive",
                           {{"type", {{"type", "integer"}, {"enum", {0, 1, 2}}}},
                            {"pose", pose},
                            {"thickness", typed("number")},
                            {"scale_invariant", typed("boolean")},
                            {"points", list_of(numbers("foxglove.Point3", {"x", "y", "z"}))},
                            {"color", colour},
                            {"colors", list_of(colour)},
                            {"indices", list_of(typed("integer"))}});
  const Json sphere =
      object("foxglove.SpherePrimitive", {{"pose", pose}, {"size", vector}, {"color", colour}});
  const Json metadata =
      object("foxglove.KeyValuePair", {{"key", typed("string")}, {"value", typed("string")}});
  const Json deletion =
      object("foxglove.SceneEntityDeletion", {{"timestamp", time},
                                              {"type", {{"type", "integer"}, {"enum", {0, 1}}}},
                                              {"id", typed("string")}});
  const Json others = list_of(typed("object"));
  const Json entity = object("foxglove.SceneEntity", {{"timestamp", time},
                                                      {"frame_id", typed("string")},
                                                      {"id", typed("string")},
                                                      {"lifetime", time_of("duration")},
                                                      {"frame_locked", typed("boolean")},
                                                      {"metadata", list_of(metadata)},
                                                      {"arrows", others},
                                                      {"cubes", others},
                                                      {"spheres", list_of(sphere)},
                                                      {"cylinders", others},
                                                      {"lines", list_of(line)},
                                                      {"triangles", others},
                                                      {"texts", others},
                                                      {"models", others}});
  return object("foxglove.SceneUpdate",
                {{"deletions", list_of(deletion)}, {"entities", list_of(entity)}})
      .dump();
}

std::string image_schema() {
  const Json data{{"type", "string"}, {"contentEncoding", "base64"}};
  return object("foxglove.CompressedImage", {{"timestamp", time_of("time")},
                                             {"frame_id", typed("string")},
                                             {"data", data},
                                             {"format", typed("string")}})
      .dump();
}

std::string detection_schema() {
  const Json integer = typed("integer");
  const Json number = typed("number");
  // Not every loop has a match in this session.
  const auto add_match = [&](Json& schema) {
    for (const char* name : {"match", "earlier_session", "earlier_frame"}) {
      schema["properties"][name] = integer;
    }
  };
  Json late =
      object("loopbit.LateLoop", {{"frame", integer}, {"score", number}, {"similarity", number}});
  add_match(late);
  const Json times =
      numbers("loopbit.StepTimes", {"content", "retrieval", "features", "verification", "total"});
  Json schema = object("loopbit.Detection", {{"timestamp", time_of("time")},
                                             {"frame", integer},
                                             {"name", typed("string")},
                                             {"status", typed("string")},
                                             {"is_loop", typed("boolean")},
                                             {"score", number},
                                             {"threshold", number},
                                             {"similarity", number},
                                             {"matches", integer},
                                             {"inliers", integer},
                                             {"times_ms", times},
                                             {"late_loops", list_of(late)},
                                             {"withdrawn_loops", list_of(late)}});
  // Not every frame has them.
  schema["properties"]["terms"] =
      numbers("loopbit.ScoreTerms", {"votes", "geometry", "path", "rivals", "prior"});
  add_match(schema);
  return schema.dump();
}

}  // namespace loopbit
