// The press of examples/c/press.c in C#, through P/Invoke: the same lines, to the last digit.
//
// usage: press.exe SCENE      mcs press.cs && LD_LIBRARY_PATH=... mono press.exe SCENE
using System;
using System.Globalization;
using System.Runtime.InteropServices;

// What this program needs of palpate.h: a struct begins with its size; a function that may fail returns 0 or an error.
static class Palpate {
  const string Library = "libpalpate.so.1";

  [StructLayout(LayoutKind.Sequential)]
  public struct Tool {
    public uint Size, Id;
    public int Contact, HasPatch;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] PositionM;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] ForceN;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct Pose {
    public double X, Y, Z;
    public double TurnX, TurnY, TurnZ, TurnW; // all 0: upright
    public double Opening;
  }

  [StructLayout(LayoutKind.Sequential)]
  public struct Tick {
    public uint Size;
    public int Contact, HasPatch, Zero;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 3)] public double[] ForceN;
  }

  [DllImport(Library)] static extern IntPtr palpate_error();
  [DllImport(Library)] public static extern int palpate_scene_open(string file, out IntPtr scene);
  [DllImport(Library)] public static extern void palpate_scene_free(IntPtr scene);
  [DllImport(Library)] public static extern int palpate_scene_home(IntPtr scene, double[] home);
  [DllImport(Library)] public static extern int palpate_body_new(IntPtr scene, out IntPtr body);
  [DllImport(Library)] public static extern void palpate_body_free(IntPtr body);
  [DllImport(Library)] public static extern int palpate_body_step(IntPtr body, IntPtr options, UIntPtr tools, uint[] ids, UIntPtr ticks, Pose[] poses);
  [DllImport(Library)] public static extern int palpate_body_tool(IntPtr body, uint id, ref Tool tool);
  [DllImport(Library)] public static extern int palpate_player_new(IntPtr body, uint id, out IntPtr player);
  [DllImport(Library)] public static extern void palpate_player_free(IntPtr player);
  [DllImport(Library)] public static extern int palpate_player_tick(IntPtr player, ref Pose pose, ref Tick tick);

  const int BadInput = 1;

  public static void Check(int result) {
    if (result == 0) return;
    Console.Error.WriteLine("press: " + Marshal.PtrToStringAnsi(palpate_error()));
    Environment.Exit(result == BadInput ? 2 : 1);
  }
}

static class Press {
  const int Ticks = 50, Frames = 20;

  static int Main(string[] arguments) {
    if (arguments.Length != 1) {
      Console.Error.WriteLine("usage: press.exe SCENE");
      return 2;
    }
    IntPtr scene, body, player = IntPtr.Zero;
    var home = new double[3];
    var path = new Palpate.Pose[Ticks];
    var sensed = new Palpate.Tick { Size = (uint)Marshal.SizeOf(typeof(Palpate.Tick)) };
    Palpate.Check(Palpate.palpate_scene_open(arguments[0], out scene));
    Palpate.Check(Palpate.palpate_scene_home(scene, home));
    Palpate.Check(Palpate.palpate_body_new(scene, out body));
    Palpate.palpate_scene_free(scene);
    for (int frame = 0; frame < Frames; ++frame) {
      for (int tick = 0; tick < Ticks; ++tick) {
        double down = 0.03 * (frame * Ticks + tick + 1) / (Frames * Ticks);
        path[tick] = new Palpate.Pose { X = home[0], Y = home[1], Z = home[2] - down };
        if (player != IntPtr.Zero) Palpate.Check(Palpate.palpate_player_tick(player, ref path[tick], ref sensed));
      }
      Palpate.Check(Palpate.palpate_body_step(body, IntPtr.Zero, (UIntPtr)1, new uint[] { 1 }, (UIntPtr)Ticks, path));
      var tool = new Palpate.Tool { Size = (uint)Marshal.SizeOf(typeof(Palpate.Tool)) };
      Palpate.Check(Palpate.palpate_body_tool(body, 1, ref tool));
      string felt = player == IntPtr.Zero ? "" : string.Format(CultureInfo.InvariantCulture, ", felt {0:F3} N", sensed.ForceN[2]);
      Console.WriteLine(string.Format(CultureInfo.InvariantCulture, "{0,4} ms: {1:F3} N{2}", 50 * (frame + 1), tool.ForceN[2], felt));
      Palpate.palpate_player_free(player);
      player = IntPtr.Zero;
      if (tool.HasPatch != 0) Palpate.Check(Palpate.palpate_player_new(body, 1, out player));
    }
    Palpate.palpate_player_free(player);
    Palpate.palpate_body_free(body);
    return 0;
  }
}
