/* The C interface beside a run in C++ (bindings_runs): the same bits; then its errors, sizes of structs of other versions, null.
 *
 * usage: check_c SCENE FOLDER
 */
#include <math.h>
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPECT(condition)                                                                   \
  do {                                                                                      \
    if (!(condition)) {                                                                     \
      fprintf(stderr, "%s:%d: %s (%s)\n", __FILE__, __LINE__, #condition, palpate_error()); \
      exit(1);                                                                              \
    }                                                                                       \
  } while (0)

/* Allocations of this thread while `counting`: these functions stand before the C library's, for libpalpate.so too. */
static _Thread_local int counting;
static _Thread_local int allocations;
void* __libc_malloc(size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void* malloc(size_t size) {
  allocations += counting;
  return __libc_malloc(size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  allocations += counting;
  return __libc_memalign(alignment, size);
}

static double* read_numbers(const char* folder, const char* name, size_t* count) {
  char file[4096];
  snprintf(file, sizeof file, "%s/%s", folder, name);
  FILE* in = fopen(file, "rb");
  EXPECT(in);
  fseek(in, 0, SEEK_END);
  *count = (size_t)ftell(in) / sizeof(double);
  rewind(in);
  double* numbers = malloc(*count * sizeof(double));
  EXPECT(fread(numbers, sizeof(double), *count, in) == *count);
  fclose(in);
  return numbers;
}

static void place(const double home[3], int ms, double at[3]) {
  at[0] = home[0];
  at[1] = home[1];
  at[2] = home[2] - 0.0003 * ms;
}

static palpate_body* press(const char* scene_file, const char* folder) {
  palpate_scene* scene;
  palpate_body* body;
  palpate_player* player;
  double home[3];
  palpate_pose at = {0};
  palpate_tick felt = {.size = sizeof felt};
  const uint32_t hand = 1;
  EXPECT(palpate_scene_open(scene_file, &scene) == PALPATE_OK);
  EXPECT(palpate_scene_home(scene, home) == PALPATE_OK);
  EXPECT(palpate_body_new(scene, &body) == PALPATE_OK);
  const double* rest;
  const uint32_t* triangles;
  size_t nodes, faces;
  EXPECT(palpate_scene_vertices(scene, &rest, &nodes) == PALPATE_OK && nodes > 100);
  EXPECT(palpate_scene_triangles(scene, &triangles, &faces) == PALPATE_OK && faces > 100);
  for (size_t k = 0; k < 3 * faces; ++k) EXPECT(triangles[k] < nodes);
  palpate_scene_free(scene);
  size_t numbers, done = 0;
  double* expected = read_numbers(folder, "frame.f64", &numbers);
  palpate_tool tool = {.size = sizeof tool};
  for (int frame = 0; frame < 2; ++frame) {
    palpate_pose path[50] = {0};
    for (int k = 0; k < 50; ++k) place(home, 50 * frame + k + 1, path[k].position_m);
    const palpate_step_options options = {.size = sizeof options, .scheme = "hyper", .horizon_s = 0.15};
    EXPECT(palpate_body_step(body, &options, 1, &hand, 50, path) == PALPATE_OK);
    const double* shape;
    size_t count;
    EXPECT(palpate_body_shape(body, &shape, &count) == PALPATE_OK && count == nodes);
    EXPECT(memcmp(shape, expected + done, 3 * count * sizeof(double)) == 0);
    EXPECT(palpate_body_tool(body, hand, &tool) == PALPATE_OK);
    done += 3 * count;
    EXPECT(memcmp(tool.force_n, expected + done, sizeof tool.force_n) == 0);
    done += 3;
  }
  EXPECT(done == numbers && tool.has_patch == 1 && tool.id == 1 && tool.position_m[2] == home[2] - 0.0003 * 100);
  free(expected);
  expected = read_numbers(folder, "played.f64", &numbers);
  EXPECT(palpate_player_new(body, hand, &player) == PALPATE_OK);
  for (int k = 0; k < 100; ++k) {
    place(home, 101 + k, at.position_m);
    counting = 1;
    EXPECT(palpate_player_tick(player, &at, &felt) == PALPATE_OK);
    counting = 0;
    EXPECT(memcmp(felt.force_n, expected + 3 * k, sizeof felt.force_n) == 0);
  }
  free(expected);
  EXPECT(allocations == 0);
  at.position_m[0] = at.orientation[0] = at.opening = NAN;
  EXPECT(palpate_player_tick(player, &at, &felt) == PALPATE_OK && isfinite(felt.force_n[2]) && felt.contact);
  palpate_player_free(player);
  return body;
}

static void errors(palpate_body* body, const char* scene_file) {
  palpate_scene* scene;
  EXPECT(palpate_scene_open("/no/such/scene.json", &scene) == PALPATE_BAD_INPUT &&
         strstr(palpate_error(), "/no/such/scene.json"));
  EXPECT(palpate_scene_open(NULL, &scene) == PALPATE_BAD_INPUT &&
         strcmp(palpate_error(), "file: is null; expected a pointer") == 0);
  EXPECT(palpate_scene_open(scene_file, NULL) == PALPATE_BAD_INPUT &&
         palpate_scene_vertices(NULL, NULL, NULL) == PALPATE_BAD_INPUT);
  EXPECT(palpate_body_new(NULL, NULL) == PALPATE_BAD_INPUT && palpate_player_new(NULL, 1, NULL) == PALPATE_BAD_INPUT);
  EXPECT(palpate_client_join(NULL, NULL) == PALPATE_BAD_INPUT && palpate_viewer_join(NULL, NULL) == PALPATE_BAD_INPUT);
  EXPECT(palpate_client_tick(NULL, NULL, NULL) == PALPATE_BAD_INPUT &&
         palpate_player_tick(NULL, NULL, NULL) == PALPATE_BAD_INPUT);
  EXPECT(palpate_body_step_alone(NULL, 1) == PALPATE_BAD_INPUT);
  EXPECT(palpate_body_step_alone(body, 0) == PALPATE_BAD_INPUT && palpate_body_step_alone(body, 1001) == PALPATE_BAD_INPUT);
  const uint32_t hand = 1;
  const palpate_pose nowhere = {.position_m = {NAN, 0, 0}}, here = {.position_m = {0, 0, 0.3}};
  EXPECT(palpate_body_step(body, NULL, 1, &hand, 1, &nowhere) == PALPATE_BAD_INPUT &&
         strstr(palpate_error(), "path of tool 1[0]"));
  const palpate_pose skewed = {.position_m = {0, 0, 0.3}, .orientation = {0, 0, 0, 2}},
                     wide = {.position_m = {0, 0, 0.3}, .opening = 2};
  EXPECT(palpate_body_step(body, NULL, 1, &hand, 1, &skewed) == PALPATE_BAD_INPUT &&
         strstr(palpate_error(), "orientation of path of tool 1[0]: has the length 2"));
  EXPECT(palpate_body_step(body, NULL, 1, &hand, 1, &wide) == PALPATE_BAD_INPUT && strstr(palpate_error(), "opening of path"));
  EXPECT(palpate_body_step(body, NULL, 1, &hand, (size_t)-1, &here) == PALPATE_BAD_INPUT);
  EXPECT(palpate_body_step(body, NULL, (size_t)-1, &hand, 1, &here) == PALPATE_BAD_INPUT);
  EXPECT(palpate_body_step(body, NULL, 0, NULL, 1, &here) == PALPATE_BAD_INPUT);
  palpate_step_options options = {.size = sizeof options, .scheme = "cube"};
  EXPECT(palpate_body_step(body, &options, 1, &hand, 1, &here) == PALPATE_BAD_INPUT &&
         strstr(palpate_error(), "scheme \"cube\""));
  options.size = 0;
  EXPECT(palpate_body_step(body, &options, 1, &hand, 1, &here) == PALPATE_BAD_INPUT && strstr(palpate_error(), "sizeof"));
  int64_t time_us;
  EXPECT(palpate_body_time_us(body, &time_us) == PALPATE_OK && time_us == 100000);

  palpate_tool tool = {.size = sizeof tool};
  EXPECT(palpate_body_tool(body, 2, &tool) == PALPATE_BAD_INPUT);
  palpate_tool older; /* of a version that ended with has_patch */
  memset(&older, 0x55, sizeof older);
  older.size = offsetof(palpate_tool, position_m);
  EXPECT(palpate_body_tool(body, 1, &older) == PALPATE_OK && older.id == 1 && older.size == offsetof(palpate_tool, position_m));
  for (size_t k = older.size; k < sizeof older; ++k) EXPECT(((const unsigned char*)&older)[k] == 0x55);

  palpate_client_options joining = {.size = sizeof joining};
  palpate_client* client;
  EXPECT(palpate_client_join(&joining, &client) == PALPATE_BAD_INPUT && strstr(palpate_error(), "server"));
  joining.server = "127.0.0.1:9";
  EXPECT(palpate_client_join(&joining, &client) == PALPATE_OK);
  EXPECT(palpate_client_wait(client, 0.5) == PALPATE_FAILED && strcmp(palpate_error(), "nothing listens at 127.0.0.1:9") == 0);
  palpate_tick tick = {.size = sizeof tick};
  counting = 1;
  EXPECT(palpate_client_tick(client, &here, &tick) == PALPATE_OK && !tick.has_patch && tick.force_n[2] == 0);
  counting = 0;
  EXPECT(allocations == 0);
  counting = 1;
  EXPECT(palpate_body_step_alone(body, 1) == PALPATE_OK);
  counting = 0;
  EXPECT(allocations > 0); /* they are seen */
  palpate_client_free(client);
  palpate_viewer_options viewing = {.size = sizeof viewing, .server = "127.0.0.1:9"};
  palpate_viewer* viewer;
  size_t count;
  EXPECT(palpate_viewer_join(&viewing, &viewer) == PALPATE_OK);
  EXPECT(palpate_viewer_wait(viewer, 0.2) == PALPATE_FAILED);
  EXPECT(palpate_viewer_tools(viewer, &count) == PALPATE_BAD_INPUT);
  palpate_viewer_free(viewer);
  palpate_scene_free(NULL);
  palpate_body_free(NULL);
  palpate_player_free(NULL);
  palpate_client_free(NULL);
  palpate_viewer_free(NULL);
}

/* A server of two rooms in this process: a station pulls in one, a viewer sees it. */
static void serve(const char* scene_file) {
  palpate_scene* scene;
  EXPECT(palpate_scene_open(scene_file, &scene) == PALPATE_OK);
  const palpate_scene* scenes[2] = {scene, scene};
  const char *names[2] = {"left", "right"}, *same[2] = {"left", "left"}, *address;
  palpate_server* server;
  palpate_server_options options = {.size = sizeof options, .rooms = 2, .scenes = scenes, .names = same};
  EXPECT(palpate_server_start(NULL, &server) == PALPATE_BAD_INPUT && palpate_server_address(NULL, &address) == PALPATE_BAD_INPUT);
  EXPECT(palpate_server_start(&options, &server) == PALPATE_BAD_INPUT && strstr(palpate_error(), "there is a room \"left\""));
  options.names = names;
  options.listen = "0.0.0.0:0";
  EXPECT(palpate_server_start(&options, &server) == PALPATE_BAD_INPUT && strstr(palpate_error(), "key_file"));
  options.listen = NULL;
  options.rate_hz = -1;
  EXPECT(palpate_server_start(&options, &server) == PALPATE_BAD_INPUT && strstr(palpate_error(), "rate_hz"));
  options.rate_hz = 0;
  EXPECT(palpate_server_start(&options, &server) == PALPATE_OK);
  palpate_scene_free(scene);
  EXPECT(palpate_server_address(server, &address) == PALPATE_OK && strncmp(address, "127.0.0.1:", 10) == 0);
  palpate_client* client;
  palpate_viewer* viewer;
  const palpate_client_options joining = {.size = sizeof joining, .server = address, .station = "hand", .room = "right"};
  const palpate_viewer_options viewing = {.size = sizeof viewing, .server = address, .room = "right"};
  palpate_pose home = {0};
  palpate_tick tick = {.size = sizeof tick};
  EXPECT(palpate_client_join(&joining, &client) == PALPATE_OK && palpate_client_wait(client, 30) == PALPATE_OK);
  EXPECT(palpate_client_home(client, home.position_m) == PALPATE_OK);
  EXPECT(palpate_viewer_join(&viewing, &viewer) == PALPATE_OK && palpate_viewer_wait(viewer, 30) == PALPATE_OK);
  size_t tools = 0;
  for (int k = 0; k < 1000 && tools == 0; ++k) {
    int32_t shown;
    EXPECT(palpate_client_tick(client, &home, &tick) == PALPATE_OK);
    EXPECT(palpate_viewer_update(viewer, 0.02, &shown) == PALPATE_OK);
    EXPECT(palpate_viewer_tools(viewer, &tools) == PALPATE_OK);
  }
  EXPECT(tools == 1 && palpate_server_check(server) == PALPATE_OK);
  palpate_server_free(server);
  palpate_client_free(client);
  palpate_viewer_free(viewer);
  palpate_server_free(NULL);
}

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  EXPECT(strlen(palpate_version()) >= 5 && palpate_error()[0] == 0);
  palpate_body* body = press(argv[1], argv[2]);
  errors(body, argv[1]);
  palpate_body_free(body);
  serve(argv[1]);
  return 0;
}
