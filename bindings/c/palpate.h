/* Palpate for programs in C, and in every language that calls C: bodies and patches in this process, a server, a station and a
 * viewer at a server. Link with -lpalpate.
 *
 * Units: metres, newtons, seconds; times of bodies in microseconds. Vectors are three doubles x, y, z in frame W; forces act on
 * the tool. Arrays of vectors are x0, y0, z0, x1, ...
 *
 * Results: functions that may fail return PALPATE_OK or an error, and then palpate_error() has its text, for this thread, until
 * its next call that fails. No exception leaves the library. A null handle or pointer, where one is needed, is PALPATE_BAD_INPUT.
 *
 * Structs begin with their size, which the caller sets to sizeof: a library of another version reads and writes no more than
 * that. Set all other fields of an options struct that you do not use to zero, which is each one's default.
 *
 * Memory: a handle is freed by its own _free(), which takes null. Pointers that a function gives belong to the handle and are
 * valid until the call that is named there, or its _free().
 *
 * Threads: one handle, one thread at a time; different handles share nothing. palpate_player_tick() and palpate_client_tick() do
 * not allocate, lock or log: they may be called in a loop of 1 kHz.
 */
#ifndef PALPATE_H
#define PALPATE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif
#ifdef __cplusplus
extern "C" {
#endif

enum {
  PALPATE_OK = 0,
  PALPATE_BAD_INPUT = 1, /* an argument or file: the text says where, what, and what was expected */
  PALPATE_FAILED = 2     /* anything else: a server that refuses or does not answer, a model that cannot be stepped, no memory */
};

/* Version of the library, "0.1.0". */
const char* palpate_version(void);
/* Text of this thread's last error; empty before the first. */
const char* palpate_error(void);

/* Pose of a tool. */
typedef struct palpate_pose {
  double position_m[3];
  double orientation[4]; /* of an instrument: a quaternion x, y, z, w from its frame to W; all 0: upright, or a point */
  double opening;        /* of its jaws, 0 closed to 1 wide open */
} palpate_pose;

/* --- scenes --- */

typedef struct palpate_scene palpate_scene;

/* Reads a scene file. */
int palpate_scene_open(const char* file, palpate_scene** scene);
void palpate_scene_free(palpate_scene* scene);
/* Start of a tool [m]: 20 mm above the top of the body, or the node that it holds. */
int palpate_scene_home(const palpate_scene* scene, double home[3]);
/* Positions of the vertices at rest [m]: *count vectors, those of the nodes first. Until _free(). */
int palpate_scene_vertices(const palpate_scene* scene, const double** positions, size_t* count);
/* Outer surface: *count triangles of three vertices, counter-clockwise seen from outside. Until _free(). */
int palpate_scene_triangles(const palpate_scene* scene, const uint32_t** triangles, size_t* count);

/* --- a body and its tools in this process, in virtual time --- */

typedef struct palpate_body palpate_body;

typedef struct palpate_step_options {
  uint32_t size;
  int32_t no_patches;      /* not 0: make no patches */
  const char* scheme;      /* hold, tangent, ring, port or hyper; null: hyper */
  int32_t order;           /* states of a patch; 0: as the scheme has them */
  int32_t no_shape;        /* not 0: palpate_body_shape() has nothing */
  double horizon_s;        /* age up to which a patch predicts the hand; 0: 0.1 s */
  const char* const* held; /* names of the scene's tools that those of the step are, as many as they; null: all are the first */
} palpate_step_options;

typedef struct palpate_tool {
  uint32_t size;
  uint32_t id;
  int32_t contact;   /* 1: touches or holds the body */
  int32_t has_patch; /* 1: palpate_player_new() has something to play */
  double position_m[3];
  double force_n[3];
  double torque_n_m[3];  /* on an instrument, about the tool point */
  double orientation[4]; /* all 0: its device has none */
  double opening;
} palpate_tool;

/* The body at rest, at time 0. The scene may be freed. */
int palpate_body_new(const palpate_scene* scene, palpate_body** body);
void palpate_body_free(palpate_body* body);
/* Moves `tools` tools of the numbers `ids` (1, 2, ...) and the body by `ticks` milliseconds, 1 to 1000. poses: first all
 * `ticks` poses of the first tool, 1 ms apart, then those of the next. A tool that was not in the last step starts at its
 * first pose; one that is missing is removed. options may be null. */
int palpate_body_step(palpate_body* body, const palpate_step_options* options, size_t tools, const uint32_t* ids, size_t ticks,
                      const palpate_pose* poses);
/* The same without tools. */
int palpate_body_step_alone(palpate_body* body, size_t ticks);
/* Puts the body back to rest at the beginning of the next step. */
int palpate_body_reset(palpate_body* body);
/* Time of the body. */
int palpate_body_time_us(const palpate_body* body, int64_t* time_us);
/* A tool at the end of the last step, with the force of the full model. */
int palpate_body_tool(const palpate_body* body, uint32_t id, palpate_tool* tool);
/* Positions of all vertices at the end of the last step. Until the next step. */
int palpate_body_shape(const palpate_body* body, const double** positions, size_t* count);

/* --- a patch, a tick at a time --- */

typedef struct palpate_player palpate_player;

/* Plays the patch that the last step made for a tool, from the end of that step on. */
int palpate_player_new(const palpate_body* body, uint32_t id, palpate_player** player);
void palpate_player_free(palpate_player* player);
/* What a hand feels at one tick. */
typedef struct palpate_tick {
  uint32_t size;
  int32_t contact;   /* 1: the tool touches */
  int32_t has_patch; /* 0: no patch has arrived, so there is no force */
  int32_t zero;
  double force_n[3];
  double patch_age_s;
  double torque_n_m[3]; /* on an instrument, about the tool point */
  double grip_n_m;      /* moment of jaws, positive where it opens them */
} palpate_tick;

/* Moves the tool to `pose`, 1 ms later. A position that is not finite, or beyond 10 m, counts as a tool that stands still, an
 * orientation that is not of length 1 as one that does not turn. */
int palpate_player_tick(palpate_player* player, const palpate_pose* pose, palpate_tick* tick);

/* --- a station at a server --- */

typedef struct palpate_client palpate_client;

typedef struct palpate_client_options {
  uint32_t size;
  uint32_t zero;
  const char* server;     /* HOST:PORT */
  const char* station;    /* name; null: "hand"; the server assigns a similar one when it is in use */
  const char* room;       /* null: the server's first */
  const char* scheme;     /* null: "auto", the server chooses */
  const char* key_file;   /* null: none */
  const char* token_file; /* null: none */
  double force_max_n;     /* 0: not limited */
  double slew_max_n_s;    /* 0: not limited */
  const char* tool;       /* name of the tool that it holds, of a scene with several; null: the first */
} palpate_client_options;

/* Begins to join; a thread of the library keeps the session. */
int palpate_client_join(const palpate_client_options* options, palpate_client** client);
/* Leaves the server. */
void palpate_client_free(palpate_client* client);
/* Waits until the station has joined and the clocks agree, at most `most_s`. */
int palpate_client_wait(palpate_client* client, double most_s);
/* Start of a tool in this room, after palpate_client_wait(). */
int palpate_client_home(const palpate_client* client, double home[3]);
/* The tick of the present millisecond, with the tool at `pose`: call it every millisecond. In the millisecond of the last tick it
 * gives that again. Poses that are none count as in palpate_player_tick(). */
int palpate_client_tick(palpate_client* client, const palpate_pose* pose, palpate_tick* tick);

/* --- a server of bodies in this process --- */

typedef struct palpate_server palpate_server;

typedef struct palpate_server_options {
  uint32_t size;
  uint32_t rooms;                     /* number of rooms, 1 to 64 */
  const palpate_scene* const* scenes; /* one a room; they may be freed after the call */
  const char* const* names;           /* names of the rooms, one each; null: those of the scenes */
  const char* listen;                 /* HOST:PORT for UDP, port 0: a free one; null: "127.0.0.1:0" */
  const char* key_file;               /* keys of the site (palpate-key new); null: none, for this machine alone */
  double rate_hz;                     /* frames a second, 1 to 1000; 0: 20 */
} palpate_server_options;

/* Listens, and serves stations and viewers on threads of the library, as palpate-server does, without a recording. */
int palpate_server_start(const palpate_server_options* options, palpate_server** server);
/* Says goodbye to the stations and ends. */
void palpate_server_free(palpate_server* server);
/* The address at which it listens, as "127.0.0.1:47800". Until _free(). */
int palpate_server_address(const palpate_server* server, const char** address);
/* PALPATE_FAILED when no body could continue, with the reason: nobody is served any more. */
int palpate_server_check(const palpate_server* server);

/* --- a viewer at a server --- */

typedef struct palpate_viewer palpate_viewer;

typedef struct palpate_viewer_options {
  uint32_t size;
  uint32_t zero;
  const char* server;     /* HOST:PORT */
  const char* station;    /* name; null: "viewer" */
  const char* room;       /* null: the server's first */
  const char* key_file;   /* null: none */
  const char* token_file; /* null: none */
} palpate_viewer_options;

/* Begins to join. */
int palpate_viewer_join(const palpate_viewer_options* options, palpate_viewer** viewer);
/* Leaves the server. */
void palpate_viewer_free(palpate_viewer* viewer);
/* Waits until the mesh and a first shape have arrived, at most `most_s`. */
int palpate_viewer_wait(palpate_viewer* viewer, double most_s);
/* Handles the network for `most_s`, at least once; then *shown is 1 when there is a moment to show. Call it at least four times a
 * second. */
int palpate_viewer_update(palpate_viewer* viewer, double most_s, int32_t* shown);
/* Version of the mesh: it grows when the server has another body. After palpate_viewer_wait(). */
int palpate_viewer_mesh_version(const palpate_viewer* viewer, uint64_t* version);
/* Surface: *count triangles of three vertex numbers. Until the next palpate_viewer_update(). */
int palpate_viewer_triangles(const palpate_viewer* viewer, const uint32_t** triangles, size_t* count);
/* Positions of the vertices [m], *count vectors of three floats. Until the next palpate_viewer_update(). */
int palpate_viewer_shape(const palpate_viewer* viewer, const float** positions, size_t* count);
/* Number of tools on the body, and tool k of them; *station is its name, until the next palpate_viewer_update(). id and has_patch
 * are 0. */
int palpate_viewer_tools(const palpate_viewer* viewer, size_t* count);
int palpate_viewer_tool(const palpate_viewer* viewer, size_t k, palpate_tool* tool, const char** station);

#ifdef __cplusplus
}
#endif
#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
